"""The default method: a filter of stick and slip on each element's place on the object and its force ratio."""
