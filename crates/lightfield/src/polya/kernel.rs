//! The arithmetic of a chunk of boxes, over plain arrays: compiled once per instruction set, the same bits on each.

use etendue_math::special::{exp, ln, ln_gamma};
use multiversion::multiversion;

/// Probability that a box is split, before any data (Wong & Ma 2010, section 3).
pub const SPLIT: f64 = 0.5;

/// ln Γ(c/2 + n) of each number of points: what a box brings into the evidence of the box it is half of, if halves are
/// equal under the base measure.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn add_log_gamma(c: f64, count: &[f64], out: &mut [f64]) {
    for (o, n) in out.iter_mut().zip(count) {
        *o += ln_gamma(0.5 * c + n);
    }
}

/// The part of ln (ρ/d · B) that depends on the whole box only, if halves are equal under the base measure:
/// ln (ρ/d) + ln Γ(c) − 2 ln Γ(c/2) − ln Γ(c + n) + n ln 2.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn whole_term(c: f64, splits: f64, count: &[f64], out: &mut [f64]) {
    let constant = ln(SPLIT / splits) + ln_gamma(c) - 2.0 * ln_gamma(0.5 * c);
    for (o, n) in out.iter_mut().zip(count) {
        *o = constant + n * std::f64::consts::LN_2 - ln_gamma(c + n);
    }
}

/// ln Γ(c + n) of each number of points.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn log_gamma(c: f64, count: &[f64], out: &mut [f64]) {
    for (o, n) in out.iter_mut().zip(count) {
        *o = ln_gamma(c + n);
    }
}

/// What is known of the splits of some boxes along one axis.
pub struct Trial<'a> {
    /// Base share of the lower half, and what follows from it alone.
    pub share: &'a [f64],
    pub terms: [&'a [f64]; 3],
    /// Points in the halves.
    pub lower: &'a [f64],
    pub upper: &'a [f64],
    /// ln Γ(c + n) of the whole.
    pub whole: &'a [f64],
}

/// Adds ln B of a split to `out`, theory eq. 31: p the base share of the lower half, n₀ and n₁ the points in the halves.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn add_log_bayes(c: f64, trial: &Trial<'_>, out: &mut [f64]) {
    let n = out.len();
    let (share, lower, upper, whole) = (
        &trial.share[..n],
        &trial.lower[..n],
        &trial.upper[..n],
        &trial.whole[..n],
    );
    let [prior, log_lower, log_upper] = trial.terms.map(|t| &t[..n]);
    for i in 0..n {
        let void = (share[i] <= 0.0) | (share[i] >= 1.0);
        let p = if void { 0.5 } else { share[i] };
        let beta = ln_gamma(c * p + lower[i]) + ln_gamma(c * (1.0 - p) + upper[i]) - whole[i];
        let bayes = beta + prior[i] - lower[i] * log_lower[i] - upper[i] * log_upper[i];
        out[i] += if void { 0.0 } else { bayes };
    }
}

/// ln R of each box from the logarithms of its splits' terms, `terms[k · n + i] + whole[i]`; the terms become the
/// posterior probabilities of the splits. Theory eq. 30.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn join(terms: &mut [f64], whole: &[f64], log_r: &mut [f64]) {
    let n = whole.len();
    let log_stop = ln(1.0 - SPLIT);
    let mut top = [f64::NEG_INFINITY; super::data::CHUNK];
    let mut sum = [0.0; super::data::CHUNK];
    let (top, sum) = (&mut top[..n], &mut sum[..n]);
    for split in terms.chunks_exact(n) {
        for (t, v) in top.iter_mut().zip(split) {
            *t = if *v > *t { *v } else { *t };
        }
    }
    // Against the largest term, that of no split among them.
    for ((t, w), s) in top.iter_mut().zip(whole).zip(&mut *sum) {
        let highest = if *t + w > log_stop { *t + w } else { log_stop };
        *s = exp(log_stop - highest);
        *t = w - highest;
    }
    for split in terms.chunks_exact_mut(n) {
        for ((v, t), s) in split.iter_mut().zip(&*top).zip(&mut *sum) {
            *v = exp(*v + t);
            *s += *v;
        }
    }
    for (((r, w), t), s) in log_r.iter_mut().zip(whole).zip(&*top).zip(&mut *sum) {
        *r = w - t + ln(*s);
        *s = 1.0 / *s;
    }
    for split in terms.chunks_exact_mut(n) {
        for (v, s) in split.iter_mut().zip(&*sum) {
            *v *= s;
        }
    }
}

/// What flows into halves from the boxes they are halves of.
pub struct Flow<'a> {
    /// Base share of the half.
    pub share: &'a [f64],
    /// Points in the half.
    pub half: &'a [f64],
    /// Points in the whole.
    pub whole: &'a [f64],
    /// Posterior probability that the whole is split this way.
    pub split: &'a [f32],
    /// Mean of the ratio that reaches the whole.
    pub mean: &'a [f64],
    /// Mean of its square.
    pub square: &'a [f64],
}

/// Adds the flow of mean and mean square of the ratio into the halves, theory eq. 32.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn add_flow(c: f64, flow: &Flow<'_>, mean: &mut [f64], square: &mut [f64]) {
    let n = mean.len();
    let square = &mut square[..n];
    let (share, half, whole) = (&flow.share[..n], &flow.half[..n], &flow.whole[..n]);
    let (split, m, s) = (&flow.split[..n], &flow.mean[..n], &flow.square[..n]);
    for i in 0..n {
        let void = (share[i] <= 0.0) | (share[i] >= 1.0);
        let p = if void { 1.0 } else { share[i] };
        let (alpha, total) = (c * p + half[i], c + whole[i]);
        let inverse = 1.0 / (total * p);
        let first = if void { 1.0 } else { alpha * inverse };
        let second = if void {
            1.0
        } else {
            first * ((alpha + 1.0) / ((total + 1.0) * p))
        };
        let q = f64::from(split[i]);
        mean[i] += m[i] * q * first;
        square[i] += s[i] * q * second;
    }
}
