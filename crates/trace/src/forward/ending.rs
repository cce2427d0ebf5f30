//! Which of the rays that meet one face go on, and which are absorbed.

/// Rays that meet one face, by what becomes of them.
#[derive(Debug, Default)]
pub struct Ending {
    going: Vec<u32>,
    gone: Vec<u32>,
}

impl Ending {
    /// Of some rays with two random numbers each those that go on and those that end, as the first number says. The numbers of
    /// those that go on move up.
    pub fn split(&mut self, rays: &[u32], numbers: &mut [Vec<f64>; 2], ends: impl Fn(f64) -> bool) -> (&[u32], &[u32]) {
        let n = rays.len();
        self.going.resize(n, 0);
        self.gone.resize(n, 0);
        let (going, gone) = (&mut self.going[..n], &mut self.gone[..n]);
        let [numbers, others] = numbers.each_mut().map(|list| &mut list[..n]);
        // Without branches, which nobody can foresee.
        let (mut on, mut off) = (0, 0);
        for (k, ray) in rays.iter().enumerate() {
            let ends = ends(numbers[k]);
            // No later than where they are.
            (numbers[on], others[on]) = (numbers[k], others[k]);
            (going[on], gone[off]) = (*ray, *ray);
            on += usize::from(!ends);
            off += usize::from(ends);
        }
        (&self.going[..on], &self.gone[..off])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_goes_on_with_its_numbers_or_ends() {
        let mut ending = Ending::default();
        for rays in [vec![7_u32, 3, 9, 4, 1], vec![], vec![2, 5]] {
            let own = |ray: &u32| f64::from(*ray) / 10.0;
            let mut numbers = [
                rays.iter().map(own).collect(),
                rays.iter().map(|ray| -own(ray)).collect(),
            ];
            let (going, gone) = ending.split(&rays, &mut numbers, |number| number > 0.35);
            let known = |ends: bool| {
                rays.iter()
                    .copied()
                    .filter(|ray| (*ray > 3) == ends)
                    .collect::<Vec<_>>()
            };
            assert_eq!((going, gone), (&known(false)[..], &known(true)[..]));
            for (k, ray) in going.iter().enumerate() {
                assert_eq!([numbers[0][k], numbers[1][k]], [own(ray), -own(ray)]);
            }
        }
    }
}
