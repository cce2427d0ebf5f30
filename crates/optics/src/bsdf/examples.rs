//! Some BSDFs of each kind: what the tests of all kinds go through.

use super::contract::Bsdf;

/// A BSDF by name, and how the tests integrate it.
#[derive(Clone, Debug)]
pub struct Example {
    /// The name of its file and its number.
    pub name: String,
    /// What is tested.
    pub bsdf: std::sync::Arc<dyn Bsdf>,
    /// To which the quadrature is right.
    pub quadrature: f64,
    /// Whether that is a lattice.
    pub lattice: bool,
    /// Whether indices matter.
    pub media: bool,
}

/// Some of a kind, for the tests of all kinds.
pub trait Examples: Bsdf + Sized + 'static {
    /// With all that they can be: constant, dependent on angle, black.
    fn examples() -> Vec<Self>;

    /// To which the quadrature of the tests is right for them: less for functions with kinks that it does not know.
    const QUADRATURE: f64 = 1e-6;

    /// Whether that is a lattice over the hemisphere, for functions with edges in unknown places, and not in polar coordinates
    /// about the specular direction.
    const LATTICE: bool = false;

    /// Whether the refractive indices on both sides matter.
    const MEDIA: bool = false;

    /// The same, by the name of their file and their number.
    fn named(file: &str) -> Vec<Example> {
        let each = Self::examples().into_iter().enumerate();
        each.map(|(number, bsdf)| Example {
            name: format!("{file} {number}"),
            bsdf: std::sync::Arc::new(bsdf),
            quadrature: Self::QUADRATURE,
            lattice: Self::LATTICE,
            media: Self::MEDIA,
        })
        // What is left of a BSDF is one, too.
        .flat_map(|whole| {
            let left = whole.bsdf.parts().and_then(|parts| parts.rest.cloned());
            let left = left.map(|bsdf| Example {
                name: format!("rest of {}", whole.name),
                bsdf,
                ..whole.clone()
            });
            std::iter::once(whole).chain(left)
        })
        .collect()
    }
}
