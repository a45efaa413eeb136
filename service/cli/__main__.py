"""`python -m service.cli`: the same as `stiction`."""

from service.cli import main

main()
