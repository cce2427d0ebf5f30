//! From the means of cells to the values at their centres, between which a field is linear.

/// Factor by which the value at a cell's centre may differ from the cell's mean.
const LARGEST_STEP: f64 = 8.0;

/// Values at the cell centres whose linear interpolation has, to second order, the given means over the cells.
///
/// The mean of the interpolation over a cell is ¾ of its own value and ⅛ of either neighbour's along each axis, and at a border ⅞
/// of its own: call that T v. One step of v ← v + (m − T v) from v = m takes away the blur of T but for its square; steps beyond a
/// factor of 8 would be noise, or the shadow of an edge, and are cut off. Theory eq. 39. An axis of one cell is left alone.
///
/// # Panics
/// If there is not one mean per cell of the shape.
#[must_use]
pub fn node_values(means: &[f64], shape: &[usize]) -> Vec<f64> {
    assert_eq!(means.len(), shape.iter().product::<usize>(), "one mean per cell");
    let mut blurred = means.to_vec();
    let mut spare = vec![0.0; means.len()];
    let mut row: usize = means.len();
    for n in shape {
        row /= n.max(&1);
        if *n > 1 {
            blur(&blurred, *n, row, &mut spare);
            std::mem::swap(&mut blurred, &mut spare);
        }
    }
    for (value, mean) in blurred.iter_mut().zip(means) {
        let wanted = 2.0 * mean - *value;
        *value = wanted.max(mean / LARGEST_STEP).min(mean * LARGEST_STEP);
    }
    blurred
}

/// T along one axis of `n` cells, on which one step is that many numbers.
fn blur(values: &[f64], n: usize, step: usize, out: &mut [f64]) {
    let mean = |below: f64, own: f64, above: f64| 0.75 * own + 0.125 * (below + above);
    let last = (n - 1) * step;
    for (v, out) in values.chunks_exact(n * step).zip(out.chunks_exact_mut(n * step)) {
        for k in 0..step {
            out[k] = mean(v[k], v[k], v[k + step]);
            out[last + k] = mean(v[last + k - step], v[last + k], v[last + k]);
        }
        let beside = v[..last - step].iter().zip(&v[2 * step..]);
        for ((o, v), (below, above)) in out[step..last].iter_mut().zip(&v[step..last]).zip(beside) {
            *o = mean(*below, *v, *above);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_axis_by_hand() {
        // T of the means: 1, 1.375, 3.625, 4.
        assert_eq!(node_values(&[1.0, 1.0, 4.0, 4.0], &[4]), [1.0, 0.625, 4.375, 4.0]);
        assert_eq!(node_values(&[1.0, 1.0, 4.0, 4.0], &[1, 4, 1]), [1.0, 0.625, 4.375, 4.0]);
        // No value is less than an eighth of the mean.
        assert_eq!(node_values(&[1.0, 100.0], &[2])[0], 0.125);
    }

    #[test]
    fn axes_are_blurred_one_after_the_other() {
        // Of a product of lines T is the product of theirs.
        let line = |n: usize, seed: usize| (0..n).map(|i| 2.0 + ((i * 7 + seed) % 5) as f64).collect::<Vec<f64>>();
        let (a, b, c) = (line(8, 1), line(16, 2), line(64, 3));
        let t = |values: &[f64]| {
            let sharp = node_values(values, &[values.len()]);
            values.iter().zip(sharp).map(|(v, s)| 2.0 * v - s).collect::<Vec<f64>>()
        };
        let (ta, tb, tc) = (t(&a), t(&b), t(&c));
        let cells: Vec<_> = (0..8)
            .flat_map(|i| (0..16).flat_map(move |j| (0..64).map(move |k| (i, j, k))))
            .collect();
        let means: Vec<f64> = cells.iter().map(|(i, j, k)| a[*i] * b[*j] * c[*k]).collect();
        let found = node_values(&means, &[8, 16, 64]);
        for (((i, j, k), mean), value) in cells.into_iter().zip(&means).zip(found) {
            let expected = 2.0 * mean - ta[i] * tb[j] * tc[k];
            assert!((value - expected.clamp(mean / 8.0, mean * 8.0)).abs() < 1e-12 * mean);
        }
    }
}
