//! Compressed geometry and textures.
