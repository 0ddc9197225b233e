"""Tests in Blender, by its PyPI wheel, in an environment of their own: `make test-blender`."""
