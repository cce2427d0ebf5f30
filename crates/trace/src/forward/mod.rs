//! From the sources to the detectors.
//!
//! Every ray keeps its flux and has one fate: at a surface it goes into one of the lobes, or is absorbed, by chance in
//! proportion to their shares, and in a medium it is absorbed at a distance drawn from Beer's law. So the rays that a
//! detector keeps have equal flux if those of the source have.
//!
//! `run`: how many rays, and how; `queue`: rays on their way; `sorter`: what comes next; `ending`: who is absorbed;
//! `lambertian_sheet`: many at once off a plain wall; `scattering_sheet`: off any other that lets nothing through; `interfaces`:
//! through smooth ones of solids; `step`: one by one; `block_trace`: what rays leave; `batch`: from the sources to their ends.

pub mod batch;
mod block_trace;
mod ending;
mod interfaces;
mod lambertian_sheet;
mod queue;
pub mod run;
mod scattering_sheet;
mod sorter;
mod step;
