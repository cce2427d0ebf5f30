"""A page that shows what a source looks like: a file of its own, or served to this machine's browser."""
