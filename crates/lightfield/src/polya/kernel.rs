//! The arithmetic of a chunk of boxes, over plain arrays: compiled once per instruction set, the same bits on each.

use etendue_math::special::{LARGE, exp, ln, ln_gamma, ln_gamma_of_both, ln_gamma_of_large};
use multiversion::multiversion;

use super::chunk::{Busy, GROUP};

/// Probability that a box is split, before any data (Wong & Ma 2010, section 3).
pub const SPLIT: f64 = 0.5;

/// ln Γ(c/2 + n) of each number of points, added to `out`: what a box brings into the evidence of the box it is half of, if halves
/// are equal under the base measure.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn add_log_gamma(c: f64, count: &[f64], busy: &Busy, out: &mut [f64]) {
    let (none, one) = (ln_gamma(0.5 * c), ln_gamma(0.5 * c + 1.0));
    if count.len() < GROUP {
        for (o, n) in out.iter_mut().zip(count) {
            *o += ln_gamma(0.5 * c + n);
        }
        return;
    }
    let (counts, _) = count.as_chunks::<GROUP>();
    let (out, _) = out.as_chunks_mut::<GROUP>();
    let mut groups = busy.groups().peekable();
    for (group, (out, counts)) in out.iter_mut().zip(counts).enumerate() {
        if groups.next_if_eq(&group).is_some() {
            for (o, n) in out.iter_mut().zip(counts) {
                *o += ln_gamma(0.5 * c + n);
            }
        } else {
            for (o, n) in out.iter_mut().zip(counts) {
                *o += if *n > 0.0 { one } else { none };
            }
        }
    }
}

/// The part of ln (ρ/d · B) that depends on the whole box only, if halves are equal under the base measure:
/// ln (ρ/d) + ln Γ(c) − 2 ln Γ(c/2) − ln Γ(c + n) + n ln 2.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn whole_term(c: f64, splits: f64, count: &[f64], busy: &Busy, out: &mut [f64]) {
    let constant = ln(SPLIT / splits) + ln_gamma(c) - 2.0 * ln_gamma(0.5 * c);
    let term = |n: f64| constant + n * std::f64::consts::LN_2 - ln_gamma(c + n);
    if count.len() < GROUP {
        each_of::<1>(count, busy, out, term);
    } else {
        each_of::<GROUP>(count, busy, out, term);
    }
}

/// ln Γ(c + n) of each number of points.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn log_gamma(c: f64, count: &[f64], busy: &Busy, out: &mut [f64]) {
    if c >= LARGE && count.len() >= GROUP {
        return each_of::<GROUP>(count, busy, out, |n| ln_gamma_of_large(c + n));
    }
    let term = |n: f64| ln_gamma(c + n);
    if count.len() < GROUP {
        each_of::<1>(count, busy, out, term);
    } else {
        each_of::<GROUP>(count, busy, out, term);
    }
}

#[inline(always)]
fn each_of<const B: usize>(count: &[f64], busy: &Busy, out: &mut [f64], term: impl Fn(f64) -> f64) {
    let (count, _) = count.as_chunks::<B>();
    let (out, _) = out.as_chunks_mut::<B>();
    for group in busy.groups() {
        let (out, count) = (&mut out[group], &count[group]);
        for i in 0..B {
            out[i] = term(count[i]);
        }
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
pub fn add_log_bayes(c: f64, trial: &Trial<'_>, busy: &Busy, out: &mut [f64]) {
    if out.len() < GROUP {
        add_log_bayes_of::<1>(c, trial, busy, out);
    } else {
        add_log_bayes_of::<GROUP>(c, trial, busy, out);
    }
}

#[inline(always)]
fn add_log_bayes_of<const B: usize>(c: f64, trial: &Trial<'_>, busy: &Busy, out: &mut [f64]) {
    let [share, lower, upper, whole] =
        [trial.share, trial.lower, trial.upper, trial.whole].map(|values| values.as_chunks::<B>().0);
    let [prior, log_lower, log_upper] = trial.terms.map(|values| values.as_chunks::<B>().0);
    let (out, _) = out.as_chunks_mut::<B>();
    for group in busy.groups() {
        let (share, lower, upper, whole) = (&share[group], &lower[group], &upper[group], &whole[group]);
        let (prior, log_lower, log_upper) = (&prior[group], &log_lower[group], &log_upper[group]);
        let out = &mut out[group];
        let (mut void, mut alpha, mut beta, mut least) = ([false; B], [0.0; B], [0.0; B], LARGE);
        for i in 0..B {
            void[i] = (share[i] <= 0.0) | (share[i] >= 1.0);
            let p = if void[i] { 0.5 } else { share[i] };
            alpha[i] = c * p + lower[i];
            beta[i] = c * (1.0 - p) + upper[i];
        }
        for i in 0..B {
            let less = if alpha[i] < beta[i] { alpha[i] } else { beta[i] };
            least = if less < least { less } else { least };
        }
        let mut gammas = [0.0; B];
        if least < LARGE {
            for i in 0..B {
                gammas[i] = ln_gamma_of_both::<true>(alpha[i], beta[i]);
            }
        } else {
            for i in 0..B {
                gammas[i] = ln_gamma_of_both::<false>(alpha[i], beta[i]);
            }
        }
        for i in 0..B {
            let bayes = gammas[i] - whole[i] + prior[i] - lower[i] * log_lower[i] - upper[i] * log_upper[i];
            out[i] += if void[i] { 0.0 } else { bayes };
        }
    }
}

/// ln R of each box from the logarithms of its splits' terms, `terms[k · n + i] + whole[i]`; the terms become the
/// posterior probabilities of the splits. Theory eq. 30.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub fn join(terms: &mut [f64], whole: &[f64], busy: &Busy, log_r: &mut [f64]) {
    if whole.len() < GROUP {
        join_of::<1>(terms, whole, busy, log_r);
    } else {
        join_of::<GROUP>(terms, whole, busy, log_r);
    }
}

#[inline(always)]
fn join_of<const B: usize>(terms: &mut [f64], whole: &[f64], busy: &Busy, log_r: &mut [f64]) {
    let log_stop = ln(1.0 - SPLIT);
    let (whole, _) = whole.as_chunks::<B>();
    let (log_r, _) = log_r.as_chunks_mut::<B>();
    let (terms, _) = terms.as_chunks_mut::<B>();
    let (boxes, ways) = (whole.len(), terms.len() / whole.len());
    for group in busy.groups() {
        let whole = &whole[group];
        let mut top = [f64::NEG_INFINITY; B];
        for way in 0..ways {
            let term = &terms[way * boxes + group];
            for i in 0..B {
                top[i] = if term[i] > top[i] { term[i] } else { top[i] };
            }
        }
        // Against the largest term, that of no split among them.
        let mut sum = [0.0; B];
        for i in 0..B {
            let highest = if top[i] + whole[i] > log_stop {
                top[i] + whole[i]
            } else {
                log_stop
            };
            sum[i] = exp(log_stop - highest);
            top[i] = whole[i] - highest;
        }
        for way in 0..ways {
            let term = &mut terms[way * boxes + group];
            for i in 0..B {
                term[i] = exp(term[i] + top[i]);
                sum[i] += term[i];
            }
        }
        let log_r = &mut log_r[group];
        for i in 0..B {
            log_r[i] = whole[i] - top[i] + ln(sum[i]);
            sum[i] = 1.0 / sum[i];
        }
        for way in 0..ways {
            let term = &mut terms[way * boxes + group];
            for i in 0..B {
                term[i] *= sum[i];
            }
        }
    }
}

/// Writes the posterior probabilities of a split: a simple fraction but in groups that are busy.
///
/// They are rounded down, so that they never add up to more than one; what is missing stops at the box.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
#[allow(clippy::cast_possible_truncation, reason = "seven digits are kept")]
pub fn write_split(prior: f64, term: &[f64], busy: &Busy, split: &mut [f32]) {
    const DOWN: f64 = 1.0 - f32::EPSILON as f64;
    split.fill(prior as f32);
    if term.len() < GROUP {
        for group in busy.groups() {
            split[group] = (term[group] * DOWN) as f32;
        }
        return;
    }
    let (term, _) = term.as_chunks::<GROUP>();
    let (split, _) = split.as_chunks_mut::<GROUP>();
    for group in busy.groups() {
        let (split, term) = (&mut split[group], &term[group]);
        for i in 0..GROUP {
            split[i] = (term[i] * DOWN) as f32;
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
        // α/(t p) and, of the square, that times (α + 1)/((t + 1) p), with one division.
        let inverse = 1.0 / (total * (total + 1.0) * p);
        let (first, next) = (alpha * (total + 1.0) * inverse, (alpha + 1.0) * total * inverse);
        let (first, second) = if void { (1.0, 1.0) } else { (first, first * next) };
        let q = f64::from(split[i]);
        mean[i] += m[i] * q * first;
        square[i] += s[i] * q * second;
    }
}
