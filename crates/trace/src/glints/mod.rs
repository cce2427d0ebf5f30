//! Where in its pixels a source is seen that is small there, directly or in smooth surfaces.
//!
//! Lines of sight that are spread over a pixel find the image of a lamp that covers a thousandth of it in few maps, and the
//! others do not know what they have missed. So its images are looked for beforehand, and as many lines of sight
//! again go where they are: those of both kinds share the light by the balance heuristic `[Veach1995]`. Whatever was not
//! found, or not rightly, is left to the lines that are spread evenly: no light is lost or counted twice.
//!
//! `image`: the place of an image; `targets`: points of sources; `passing`: how lines of sight pass them; `chain`: lines of
//! sight at smooth surfaces; `search`: chains of these that end on a source; `pixels`: the images in each pixel.

mod chain;
mod image;
mod passing;
mod pixels;
mod search;
mod targets;

pub use image::{Glint, STRAIGHT, density, draw, led_on};
pub use pixels::Glints;
