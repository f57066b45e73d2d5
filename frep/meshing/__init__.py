"""Blocks of samples (or graphs of beams) become triangles."""
