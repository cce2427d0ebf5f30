"""Virtual instruments, and how to take an instrument out of what it measured: thesis chapter 5."""
