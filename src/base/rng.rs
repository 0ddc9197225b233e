//! Counter-based random numbers: the value depends on what it is for, never on the order of work.

/// A short stream of random numbers keyed by `(seed, stage, pass, item)`.
///
/// # Determinism
/// The same key gives the same stream on every machine and for any number of threads.
#[derive(Debug, Clone)]
pub struct Rng(u64);

/// One round of the SplitMix64 finalizer (Steele, Lea, Flood 2014): a bijection that mixes well.
#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

impl Rng {
    /// The stream for one item (usually a pixel index) of one pass of one stage.
    #[inline]
    pub fn new(seed: u64, stage: u32, pass: u32, item: u64) -> Self {
        let key = mix(seed.wrapping_add(GOLDEN)) ^ (((stage as u64) << 32) | pass as u64);
        Self(mix(mix(key).wrapping_add(item.wrapping_mul(GOLDEN))))
    }

    /// Next 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let bits = self.nth(0);
        self.0 = self.0.wrapping_add(GOLDEN);
        (bits >> 32) as u32
    }

    /// The `i`-th draw of 64 bits from here on, counted from 0.
    #[inline(always)]
    pub fn nth(&self, i: u64) -> u64 {
        mix(self.0.wrapping_add(GOLDEN.wrapping_mul(i + 1)))
    }

    /// A number in `0..n` (`n > 0`), by the multiply-shift map.
    #[inline]
    pub fn below(&mut self, n: u32) -> u32 {
        ((self.next_u32() as u64 * n as u64) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn below_is_uniform_and_in_range() {
        let mut counts = [0u32; 7];
        for item in 0..70_000 {
            counts[Rng::new(3, 1, 2, item).below(7) as usize] += 1;
        }
        // 10 000 expected each, standard deviation 93: five of them.
        assert!(counts.iter().all(|&c| c.abs_diff(10_000) < 465), "skewed: {counts:?}");
    }

    #[test]
    fn draws_out_of_order_are_those_in_order() {
        let mut rng = Rng::new(1, 2, 3, 4);
        let ahead = rng.clone();
        let upper = |i: u64| (ahead.nth(i) >> 32) as u32;
        assert!((0..50).all(|i| upper(i) == rng.next_u32()));
    }

    #[test]
    fn each_part_of_the_key_matters() {
        let draw = |s, a, b, c| Rng::new(s, a, b, c).next_u32();
        let base = draw(1, 2, 3, 4);
        assert!(
            [draw(0, 2, 3, 4), draw(1, 0, 3, 4), draw(1, 2, 0, 4), draw(1, 2, 3, 0)]
                .iter()
                .all(|&v| v != base)
        );
    }
}
