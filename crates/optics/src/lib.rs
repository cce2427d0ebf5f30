//! What emits rays.
//!
//! `source`: one file per kind of source, each with the closed form its tests check it against.

pub mod source;
