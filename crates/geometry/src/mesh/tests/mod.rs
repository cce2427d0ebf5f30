mod distance;
mod hits;
mod meshes;
