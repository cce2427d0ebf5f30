//! Random numbers with an address, and what is drawn with them.
//!
//! `philox`: the counter-based generator. `alias`: exact sampling of a table. `warp`: the unit square to disks, annuli and hemispheres. `more_numbers`: what two numbers
//! are extended by. `guide`: where a rising list passes a number. `subset`: k of n
//! without replacement, in one pass. `ordered`: work in fixed batches whose results are taken in order, so that sums
//! have the same bits for any number of threads.

pub mod alias;
pub mod guide;
pub mod lattice;
pub mod more_numbers;
pub mod ordered;
pub mod philox;
pub mod subset;
pub mod warp;
