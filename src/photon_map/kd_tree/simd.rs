//! Sixteen numbers at once, by whatever instructions the processor has: AVX-512, AVX2 or none in particular.
//!
//! [`dispatch`] runs a piece of [`SimdWork`] compiled for the best set it finds. All sets do the same operations in the
//! same order and fuse none, so they give the same bits.
#![allow(unsafe_code, reason = "vector instructions may run only where the processor has them")]

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Numbers in a vector.
pub const LANES: usize = 16;

/// Sixteen numbers for each of `N` things, on cache lines of their own: a vector across two lines costs twice.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct LaneRows<const N: usize>(pub(crate) [[f32; LANES]; N]);

impl<const N: usize> LaneRows<N> {
    /// All the numbers of some lines, in order.
    #[inline(always)]
    pub(super) fn numbers(lines: &[Self]) -> &[f32] {
        // SAFETY: N whole lines of sixteen `f32` fill their alignment of 64 bytes, so nothing lies between the numbers.
        unsafe { std::slice::from_raw_parts(lines.as_ptr().cast(), lines.len() * N * LANES) }
    }

    /// All the numbers of some lines, in order.
    #[inline(always)]
    pub(super) fn numbers_mut(lines: &mut [Self]) -> &mut [f32] {
        // SAFETY: as above; the borrow is as exclusive as that of the lines.
        unsafe { std::slice::from_raw_parts_mut(lines.as_mut_ptr().cast(), lines.len() * N * LANES) }
    }

    /// The same, sixteen at a time.
    #[inline(always)]
    pub(super) fn blocks(lines: &[Self]) -> &[[f32; LANES]] {
        Self::numbers(lines).as_chunks().0
    }
}

/// One bit a lane.
pub(super) type Mask = u16;

/// Operations on vectors of 16 `f32`. A value of this type is proof that the processor can do them.
pub(super) trait Lanes: Copy {
    /// Sixteen `f32`.
    type Vector: Copy;
    /// Sixteen `f64`.
    type Sum: Copy;

    fn splat(self, value: f32) -> Self::Vector;
    fn load(self, from: &[f32; LANES]) -> Self::Vector;
    fn store(self, vector: Self::Vector, to: &mut [f32; LANES]);
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// `b` where the two are equal.
    fn min(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// `b` where the two are equal.
    fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// The smallest lane.
    fn smallest(self, vector: Self::Vector) -> f32;
    /// Where a < b.
    fn less(self, a: Self::Vector, b: Self::Vector) -> Mask;
    /// Where a ≤ b.
    fn at_most(self, a: Self::Vector, b: Self::Vector) -> Mask;
    /// `vector` where a ≤ b, 0 elsewhere.
    fn keep_at_most(self, vector: Self::Vector, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// Moves the lanes in `mask` to the front, in order; what follows them is of no meaning.
    fn compress(self, mask: Mask, vector: Self::Vector) -> Self::Vector;
    /// first + lane for the lanes in `mask`, in order; what follows them is of no meaning.
    fn numbers(self, mask: Mask, first: u32, to: &mut [u32; LANES]);
    fn zero(self) -> Self::Sum;
    /// Adds lane by lane, in double precision.
    fn accumulate(self, sum: Self::Sum, vector: Self::Vector) -> Self::Sum;
    /// The lanes of a sum.
    fn lanes(self, sum: Self::Sum) -> [f64; LANES];
}

/// Work that any instruction set can do. `run` has to be `#[inline(always)]`: only then is it compiled for the set.
pub(super) trait SimdWork {
    type Output;
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Instruction sets, best last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best this processor has.
    #[inline]
    fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let bits = is_x86_feature_detected!("popcnt") && is_x86_feature_detected!("bmi1");
            if bits && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
                return Self::Avx512;
            }
            if bits && is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }
}

/// Runs `work` by the best instructions there are.
#[inline]
pub(super) fn dispatch<W: SimdWork>(work: W) -> W::Output {
    let best = Level::best();
    #[cfg(test)]
    let best = best.min(tests::LIMIT.get());
    match best {
        Level::Portable => work.run(Portable),
        // SAFETY: `best` found the features that `in_avx2` is compiled for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { in_avx2(work) },
        // SAFETY: `best` found the features that `in_avx512` is compiled for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { in_avx512(work) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,bmi1")]
fn in_avx2<W: SimdWork>(work: W) -> W::Output {
    work.run(Avx2(()))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2,popcnt,bmi1")]
fn in_avx512<W: SimdWork>(work: W) -> W::Output {
    work.run(Avx512(()))
}

/// Plain Rust.
#[derive(Clone, Copy)]
struct Portable;

impl Lanes for Portable {
    type Vector = [f32; LANES];
    type Sum = [f64; LANES];

    #[inline(always)]
    fn splat(self, value: f32) -> [f32; LANES] {
        [value; LANES]
    }

    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> [f32; LANES] {
        *from
    }

    #[inline(always)]
    fn store(self, vector: [f32; LANES], to: &mut [f32; LANES]) {
        *to = vector;
    }

    #[inline(always)]
    fn add(self, a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|lane| a[lane] + b[lane])
    }

    #[inline(always)]
    fn sub(self, a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|lane| a[lane] - b[lane])
    }

    #[inline(always)]
    fn mul(self, a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|lane| a[lane] * b[lane])
    }

    #[inline(always)]
    fn min(self, a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|lane| if a[lane] < b[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn max(self, a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|lane| if a[lane] > b[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn smallest(self, vector: [f32; LANES]) -> f32 {
        let mut vector = vector;
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                vector[lane] = if vector[lane] < vector[lane + half] { vector[lane] } else { vector[lane + half] };
            }
            half /= 2;
        }
        vector[0]
    }

    #[inline(always)]
    fn less(self, a: [f32; LANES], b: [f32; LANES]) -> Mask {
        (0..LANES).fold(0, |mask, lane| mask | (Mask::from(a[lane] < b[lane]) << lane))
    }

    #[inline(always)]
    fn at_most(self, a: [f32; LANES], b: [f32; LANES]) -> Mask {
        (0..LANES).fold(0, |mask, lane| mask | (Mask::from(a[lane] <= b[lane]) << lane))
    }

    #[inline(always)]
    fn keep_at_most(self, vector: [f32; LANES], a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|lane| if a[lane] <= b[lane] { vector[lane] } else { 0.0 })
    }

    #[inline(always)]
    fn compress(self, mask: Mask, vector: [f32; LANES]) -> [f32; LANES] {
        let (mut front, mut count) = (vector, 0);
        for (lane, value) in vector.into_iter().enumerate() {
            front[count] = value;
            count += usize::from((mask >> lane) & 1);
            count &= LANES - 1; // sixteen of sixteen: nothing follows
        }
        front
    }

    #[inline(always)]
    fn numbers(self, mut mask: Mask, first: u32, to: &mut [u32; LANES]) {
        for slot in to {
            if mask == 0 {
                break;
            }
            *slot = first + mask.trailing_zeros();
            mask &= mask - 1;
        }
    }

    #[inline(always)]
    fn zero(self) -> [f64; LANES] {
        [0.0; LANES]
    }

    #[inline(always)]
    fn accumulate(self, sum: [f64; LANES], vector: [f32; LANES]) -> [f64; LANES] {
        std::array::from_fn(|lane| sum[lane] + f64::from(vector[lane]))
    }

    #[inline(always)]
    fn lanes(self, sum: [f64; LANES]) -> [f64; LANES] {
        sum
    }
}

/// AVX2: two vectors of eight. Made by [`in_avx2`] alone.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct Avx2(());

/// For each set of eight lanes, their numbers in order, a byte each.
#[cfg(target_arch = "x86_64")]
static FRONT: [u64; 256] = {
    let mut table = [0; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if (set >> lane) & 1 == 1 {
                table[set] |= (lane as u64) << (8 * count);
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    #[inline(always)]
    fn mask(self, low: __m256, high: __m256) -> Mask {
        // SAFETY: `self` is proof of AVX2.
        unsafe { (_mm256_movemask_ps(low) | (_mm256_movemask_ps(high) << 8)) as Mask }
    }

    /// Lane numbers that move the lanes in `set` to the front.
    #[inline(always)]
    fn front(self, set: Mask) -> __m256i {
        // SAFETY: `self` is proof of AVX2.
        unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(FRONT[usize::from(set & 0xff)] as i64)) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx2 {
    type Vector = [__m256; 2];
    type Sum = [__m256d; 4];

    #[inline(always)]
    fn splat(self, value: f32) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_set1_ps(value); 2] }
    }

    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2; 8 + 8 numbers are there to read, at any alignment.
        unsafe { [_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))] }
    }

    #[inline(always)]
    fn store(self, vector: [__m256; 2], to: &mut [f32; LANES]) {
        // SAFETY: `self` is proof of AVX2; 8 + 8 numbers are there to write, at any alignment.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), vector[0]);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), vector[1]);
        }
    }

    #[inline(always)]
    fn add(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_add_ps(a[0], b[0]), _mm256_add_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn sub(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_sub_ps(a[0], b[0]), _mm256_sub_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_mul_ps(a[0], b[0]), _mm256_mul_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn min(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_min_ps(a[0], b[0]), _mm256_min_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn max(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_max_ps(a[0], b[0]), _mm256_max_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn smallest(self, vector: [__m256; 2]) -> f32 {
        // SAFETY: `self` is proof of AVX2.
        unsafe {
            let eight = _mm256_min_ps(vector[0], vector[1]);
            let four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps::<1>(eight));
            let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }

    #[inline(always)]
    fn less(self, a: [__m256; 2], b: [__m256; 2]) -> Mask {
        // SAFETY: `self` is proof of AVX2.
        unsafe { self.mask(_mm256_cmp_ps::<_CMP_LT_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_LT_OQ>(a[1], b[1])) }
    }

    #[inline(always)]
    fn at_most(self, a: [__m256; 2], b: [__m256; 2]) -> Mask {
        // SAFETY: `self` is proof of AVX2.
        unsafe { self.mask(_mm256_cmp_ps::<_CMP_LE_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_LE_OQ>(a[1], b[1])) }
    }

    #[inline(always)]
    fn keep_at_most(self, vector: [__m256; 2], a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: `self` is proof of AVX2.
        unsafe {
            [
                _mm256_and_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a[0], b[0]), vector[0]),
                _mm256_and_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a[1], b[1]), vector[1]),
            ]
        }
    }

    #[inline(always)]
    fn compress(self, mask: Mask, vector: [__m256; 2]) -> [__m256; 2] {
        let mut front = [0.0; LANES];
        // SAFETY: `self` is proof of AVX2; the second store begins at most 8 numbers into the sixteen.
        unsafe {
            let count = (mask & 0xff).count_ones() as usize;
            _mm256_storeu_ps(front.as_mut_ptr(), _mm256_permutevar8x32_ps(vector[0], self.front(mask)));
            let high = _mm256_permutevar8x32_ps(vector[1], self.front(mask >> 8));
            _mm256_storeu_ps(front.as_mut_ptr().add(count), high);
        }
        self.load(&front)
    }

    #[inline(always)]
    fn numbers(self, mask: Mask, first: u32, to: &mut [u32; LANES]) {
        // SAFETY: `self` is proof of AVX2; the second store begins at most 8 numbers into the sixteen.
        unsafe {
            let count = (mask & 0xff).count_ones() as usize;
            let low = _mm256_add_epi32(self.front(mask), _mm256_set1_epi32(first as i32));
            _mm256_storeu_si256(to.as_mut_ptr().cast(), low);
            let high = _mm256_add_epi32(self.front(mask >> 8), _mm256_set1_epi32(first as i32 + 8));
            _mm256_storeu_si256(to.as_mut_ptr().add(count).cast(), high);
        }
    }

    #[inline(always)]
    fn zero(self) -> [__m256d; 4] {
        // SAFETY: `self` is proof of AVX2.
        unsafe { [_mm256_setzero_pd(); 4] }
    }

    #[inline(always)]
    fn accumulate(self, sum: [__m256d; 4], vector: [__m256; 2]) -> [__m256d; 4] {
        // SAFETY: `self` is proof of AVX2.
        unsafe {
            [
                _mm256_add_pd(sum[0], _mm256_cvtps_pd(_mm256_castps256_ps128(vector[0]))),
                _mm256_add_pd(sum[1], _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(vector[0]))),
                _mm256_add_pd(sum[2], _mm256_cvtps_pd(_mm256_castps256_ps128(vector[1]))),
                _mm256_add_pd(sum[3], _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(vector[1]))),
            ]
        }
    }

    #[inline(always)]
    fn lanes(self, sum: [__m256d; 4]) -> [f64; LANES] {
        let mut lanes = [0.0; LANES];
        for (part, to) in sum.into_iter().zip(lanes.chunks_exact_mut(4)) {
            // SAFETY: `self` is proof of AVX2; the chunk has four numbers, at any alignment.
            unsafe { _mm256_storeu_pd(to.as_mut_ptr(), part) };
        }
        lanes
    }
}

/// AVX-512. Made by [`in_avx512`] alone.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct Avx512(());

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx512 {
    type Vector = __m512;
    type Sum = [__m512d; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_set1_ps(value) }
    }

    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F; sixteen numbers are there to read, at any alignment.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, vector: __m512, to: &mut [f32; LANES]) {
        // SAFETY: `self` is proof of AVX-512F; sixteen numbers are there to write, at any alignment.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), vector) }
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_mul_ps(a, b) }
    }

    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_min_ps(a, b) }
    }

    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_max_ps(a, b) }
    }

    #[inline(always)]
    fn smallest(self, vector: __m512) -> f32 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_reduce_min_ps(vector) }
    }

    #[inline(always)]
    fn less(self, a: __m512, b: __m512) -> Mask {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    fn at_most(self, a: __m512, b: __m512) -> Mask {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    fn keep_at_most(self, vector: __m512, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b), vector) }
    }

    #[inline(always)]
    fn compress(self, mask: Mask, vector: __m512) -> __m512 {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { _mm512_maskz_compress_ps(mask, vector) }
    }

    #[inline(always)]
    fn numbers(self, mask: Mask, first: u32, to: &mut [u32; LANES]) {
        // SAFETY: `self` is proof of AVX-512F; sixteen numbers are there to write, at any alignment.
        unsafe {
            let ramp = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let numbers = _mm512_add_epi32(ramp, _mm512_set1_epi32(first as i32));
            _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(mask, numbers));
        }
    }

    #[inline(always)]
    fn zero(self) -> [__m512d; 2] {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe { [_mm512_setzero_pd(); 2] }
    }

    #[inline(always)]
    fn accumulate(self, sum: [__m512d; 2], vector: __m512) -> [__m512d; 2] {
        // SAFETY: `self` is proof of AVX-512F.
        unsafe {
            let high = _mm512_shuffle_f32x4::<0b11_10_11_10>(vector, vector);
            [
                _mm512_add_pd(sum[0], _mm512_cvtps_pd(_mm512_castps512_ps256(vector))),
                _mm512_add_pd(sum[1], _mm512_cvtps_pd(_mm512_castps512_ps256(high))),
            ]
        }
    }

    #[inline(always)]
    fn lanes(self, sum: [__m512d; 2]) -> [f64; LANES] {
        let mut lanes = [0.0; LANES];
        // SAFETY: `self` is proof of AVX-512F; 8 + 8 numbers are there to write, at any alignment.
        unsafe {
            _mm512_storeu_pd(lanes.as_mut_ptr(), sum[0]);
            _mm512_storeu_pd(lanes.as_mut_ptr().add(8), sum[1]);
        }
        lanes
    }
}

#[cfg(test)]
mod tests;
