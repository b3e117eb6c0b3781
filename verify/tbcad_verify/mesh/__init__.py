"""Meshes: files, topology, smooth patches, fitted surfaces and rays."""
