"""How fast each part of the package is: one file a part, one function a measurement."""
