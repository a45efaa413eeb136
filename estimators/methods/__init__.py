"""The methods of ``fit``, one a file, and what each of them reports."""
