//! Polynomials by Horner's rule.

/// c₀ + x (c₁ + x (c₂ + …)), unrolled: `polynomial!(x, [c₀, c₁, c₂, …])`.
macro_rules! polynomial {
    ($x:expr, [$last:expr]) => {
        $last
    };
    ($x:expr, [$first:expr, $($rest:expr),+]) => {
        $first + $x * polynomial!($x, [$($rest),+])
    };
}
