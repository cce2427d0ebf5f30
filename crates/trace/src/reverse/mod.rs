//! From the observer to the sources.
//!
//! `method`: how; `render`: the passes of a map; `path_block`: paths that take their steps together; `step`: one by one;
//! `smooth`: many at one interface; `diffuse`: at diffuse surfaces.

mod diffuse;
pub mod method;
mod path_block;
pub mod render;
mod smooth;
mod step;
