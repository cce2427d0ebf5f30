"""Guards of the documentation: pages as data, and the tests over them."""
