mod distance;
mod hits;
mod meshes;
mod topology;
