//! Integrals along an interval after Gauss and Legendre.

/// Nodes and weights of the rule of Gauss and Legendre from 0 to 1.
pub const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 0.284_444_444_444_444_45),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// The integral of f after Gauss and Legendre.
pub(super) fn gauss(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    GAUSS.iter().map(|(x, w)| w * f(from + (to - from) * x)).sum::<f64>() * (to - from)
}

/// The integral of f, in parts that are halved where it is not yet exact.
pub(super) fn integral(from: f64, to: f64, whole: f64, depth: u32, f: &impl Fn(f64) -> f64) -> f64 {
    let middle = 0.5 * (from + to);
    let (a, b) = (gauss(from, middle, f), gauss(middle, to, f));
    if depth == 0 || (a + b - whole).abs() <= 1e-9 {
        a + b
    } else {
        integral(from, middle, a, depth - 1, f) + integral(middle, to, b, depth - 1, f)
    }
}
