//! Whether counts are what is expected.

/// χ² of counts against their expectations, as a normal deviate (Wilson and Hilferty), cells of less than 8 taken together.
///
/// Counts where nothing is expected are an infinite one.
pub fn deviate(counts: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(counts.len(), expected.len());
    let (mut sum, mut cells, mut few) = (0.0, 0, (0.0, 0.0));
    for (count, mean) in counts.iter().zip(expected) {
        if *mean < 1e-9 && *count > 0 {
            return f64::INFINITY;
        }
        if *mean < 8.0 {
            few = (few.0 + *count as f64, few.1 + mean);
        } else {
            sum += (*count as f64 - mean).powi(2) / mean;
            cells += 1;
        }
    }
    if few.1 >= 1.0 {
        sum += (few.0 - few.1) * (few.0 - few.1) / few.1;
        cells += 1;
    }
    if cells < 2 {
        return 0.0;
    }
    let free = f64::from(cells - 1);
    let spread = 2.0 / (9.0 * free);
    ((sum / free).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// One in 2·10⁵ deviates is above: one in a few hundred runs of all tests here.
pub const CRITICAL: f64 = 4.42;
