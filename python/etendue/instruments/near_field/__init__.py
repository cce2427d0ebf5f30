"""The virtual near-field goniophotometer: a camera and a photometer on an arm that moves around a lamp."""
