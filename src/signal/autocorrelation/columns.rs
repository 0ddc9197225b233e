//! Columns of spectra: to their power, and back.

use std::sync::Arc;

use pulp::Arch;
use realfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

/// Columns that lie together: whole cache lines.
pub(super) const BLOCK: usize = 8;

/// A row of a block.
pub(super) type Bins = [Complex<f64>; BLOCK];

const ZERO: Complex<f64> = Complex::new(0.0, 0.0);

/// Transforms blocks of columns, padded to twice a length, and the sum of their power back.
pub(super) struct Columns {
    height: usize,
    /// The even frequencies of a padded column are those of the column alone, the odd ones those of the
    /// column times these.
    turns: Vec<Complex<f64>>,
    down: Arc<dyn Fft<f64>>,
    up: Arc<dyn Fft<f64>>,
    scale: f64,
    arch: Arch,
}

/// What a thread needs for one block.
pub(super) struct Buffers {
    /// One after the other.
    columns: Vec<Complex<f64>>,
    odd: Vec<Complex<f64>>,
    /// Of each column the even frequencies, then the odd.
    power: Vec<f64>,
    scratch: Vec<Complex<f64>>,
}

impl Columns {
    /// For columns of `height`, padded to twice `half`, of rows that were padded to `cols`.
    pub(super) fn new(half: usize, height: usize, cols: usize) -> Self {
        let turn = |y: usize| {
            let angle = -std::f64::consts::PI * y as f64 / half as f64;
            Complex::new(libm::cos(angle), libm::sin(angle))
        };
        let mut plans = FftPlanner::<f64>::new();
        Self {
            height,
            turns: (0..half).map(turn).collect(),
            down: plans.plan_fft_forward(half),
            up: plans.plan_fft_inverse(half),
            scale: 0.25 / (half * cols) as f64,
            arch: Arch::new(),
        }
    }

    pub(super) fn buffers(&self) -> Buffers {
        let half = self.turns.len();
        let scratch = self.down.get_inplace_scratch_len().max(self.up.get_inplace_scratch_len());
        Buffers {
            columns: vec![ZERO; BLOCK * self.stride()],
            odd: vec![ZERO; half],
            power: vec![0.0; 2 * BLOCK * half],
            scratch: vec![ZERO; scratch],
        }
    }

    /// Columns a power of two apart would displace each other from the cache.
    fn stride(&self) -> usize {
        self.turns.len() + BLOCK
    }

    /// Adds the power of a block, whose rows come in pieces.
    pub(super) fn add_power<'a>(
        &self,
        buffers: &mut Buffers,
        rows: impl Iterator<Item = &'a [Bins]>,
    ) {
        let Buffers { columns, odd, power, scratch } = buffers;
        let half = self.turns.len();
        self.arch.dispatch(|| {
            for (y, row) in rows.flatten().enumerate() {
                for (column, &v) in columns.chunks_mut(self.stride()).zip(row) {
                    column[y] = v;
                }
            }
        });
        let columns = columns.chunks_mut(self.stride()).zip(power.chunks_mut(2 * half));
        for (column, power) in columns {
            let even = &mut column[..half];
            even[self.height..].fill(ZERO);
            let (even_power, odd_power) = power.split_at_mut(half);
            self.arch.dispatch(|| {
                for ((odd, v), turn) in odd.iter_mut().zip(&*even).zip(&self.turns) {
                    *odd = v * turn;
                }
            });
            self.down.process_with_scratch(even, scratch);
            self.down.process_with_scratch(odd, scratch);
            self.arch.dispatch(|| {
                even_power.iter_mut().zip(&*even).for_each(|(sum, v)| *sum += v.norm_sqr());
                odd_power.iter_mut().zip(&*odd).for_each(|(sum, v)| *sum += v.norm_sqr());
            });
        }
    }

    /// Transforms the power back into such rows, and forgets it.
    pub(super) fn back<'a>(
        &self,
        buffers: &mut Buffers,
        rows: impl Iterator<Item = &'a mut [Bins]>,
    ) {
        let Buffers { columns, odd: both, power, scratch } = buffers;
        let half = self.turns.len();
        for (column, power) in columns.chunks_mut(self.stride()).zip(power.chunks_mut(2 * half)) {
            // The power is real, so both halves can be transformed as one.
            let (even, odd) = power.split_at(half);
            for (both, (&re, &im)) in both.iter_mut().zip(even.iter().zip(odd)) {
                *both = Complex::new(re, im);
            }
            power.fill(0.0);
            self.up.process_with_scratch(both, scratch);
            self.arch.dispatch(|| {
                let apart = |a: Complex<f64>, b: Complex<f64>, turn: &Complex<f64>| {
                    let b = b.conj();
                    let odd = a - b;
                    (a + b + Complex::new(odd.im, -odd.re) * turn.conj()) * self.scale
                };
                column[0] = apart(both[0], both[0], &self.turns[0]);
                let mirrored = both[1..].iter().zip(both[1..].iter().rev());
                for ((to, turn), (&a, &b)) in
                    column[1..].iter_mut().zip(&self.turns[1..]).zip(mirrored)
                {
                    *to = apart(a, b, turn);
                }
            });
        }
        self.arch.dispatch(|| {
            for (y, row) in rows.flatten().enumerate() {
                for (column, v) in columns.chunks(self.stride()).zip(row) {
                    *v = column[y];
                }
            }
        });
    }
}
