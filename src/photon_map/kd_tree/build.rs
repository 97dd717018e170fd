//! Puts photons into leaves: halves them along the longest side of their box, again and again.

use rayon::prelude::*;

use super::select::{Bracket, count_at_most, kth_smallest};
use super::simd::{LANES, LaneRows, Lanes, Mask, SimdWork, dispatch};
use super::{CHILDREN, KdTree, LEAF, Leaf, Node, NodeLevel, TOPS, VECTORS};

/// Photons below which a part isn't handed to another thread.
const TASK: usize = 16_384;

/// Coordinates x, y, z of photons and their index, the bits of which are kept in an `f32` that nobody computes with.
/// Whole leaves; the places behind the photons lie at +∞.
struct Columns<'a>([&'a mut [f32]; 4]);

impl<'a> Columns<'a> {
    /// Columns in the memory of leaves. Those of a single leaf are the leaf.
    fn in_leaves(leaves: &'a mut [Leaf], photons: &'a mut [LaneRows<VECTORS>]) -> Self {
        let length = leaves.len() * LEAF;
        let (x, rest) = LaneRows::numbers_mut(leaves).split_at_mut(length);
        let (y, z) = rest.split_at_mut(length);
        Self([x, y, z, LaneRows::numbers_mut(photons)])
    }

    fn split_at(self, middle: usize) -> (Self, Self) {
        let [(x, x2), (y, y2), (z, z2), (index, index2)] = self.0.map(|column| column.split_at_mut(middle));
        (Self([x, y, z, index]), Self([x2, y2, z2, index2]))
    }

    #[inline(always)]
    fn blocks(&self, axis: usize) -> &[[f32; LANES]] {
        self.0[axis].as_chunks().0
    }
}

/// Builds the tree.
pub(super) fn build(positions: &[[f32; 3]]) -> KdTree {
    let count = positions.len();
    let leaf_count = count.div_ceil(LEAF);
    let columns = [(); 4].map(|()| vec![LaneRows([[f32::INFINITY; LANES]; VECTORS]); leaf_count]);
    let [mut x, mut y, mut z, mut index] = columns;
    let of_leaf = (&mut x, &mut y, &mut z, &mut index, positions.par_chunks(LEAF)).into_par_iter().enumerate();
    of_leaf.with_min_len(TASK / LEAF).for_each(|(leaf, (x, y, z, index, positions))| {
        let [x, y, z, index] = [x, y, z, index].map(|lines| lines.0.as_flattened_mut());
        for (place, position) in positions.iter().enumerate() {
            [x[place], y[place], z[place]] = *position;
            index[place] = f32::from_bits((leaf * LEAF + place) as u32);
        }
    });
    let mut leaves = vec![LaneRows([[0.0; LANES]; 3 * VECTORS]); leaf_count];
    let mut photons = vec![LaneRows([[0.0; LANES]; VECTORS]); leaf_count];
    let data = [&mut x, &mut y, &mut z, &mut index].map(|column| LaneRows::numbers_mut(column));
    split(Columns(data), &mut leaves, &mut photons, count);
    let photons = LaneRows::numbers(&photons).par_iter().with_min_len(TASK).map(|photon| photon.to_bits()).collect();
    let (nodes, levels) = nodes(&leaves, count);
    KdTree { count, leaves, photons, nodes, levels }
}

/// Distributes the first `count` photons of `data` among `leaves`. Which half is done by which thread changes nothing.
fn split(mut data: Columns<'_>, leaves: &mut [Leaf], photons: &mut [LaneRows<VECTORS>], count: usize) {
    if leaves.len() <= 1 {
        let leaf = Columns::in_leaves(leaves, photons);
        leaf.0.into_iter().zip(data.0).for_each(|(to, from)| to.copy_from_slice(from));
        return;
    }
    let left = left_leaves(leaves.len());
    let middle = left * LEAF;
    if middle < count {
        // The leaves are not filled yet: there is room to work in.
        let spare = &mut Columns::in_leaves(leaves, photons);
        dispatch(Halve { data: &mut data, spare, count, middle });
    }
    let (data, data2) = data.split_at(middle);
    let (leaves, leaves2) = leaves.split_at_mut(left);
    let (photons, photons2) = photons.split_at_mut(left);
    let (count, count2) = (count.min(middle), count.saturating_sub(middle));
    let first = || split(data, leaves, photons, count);
    let second = || split(data2, leaves2, photons2, count2);
    if count + count2 > TASK {
        rayon::join(first, second);
    } else {
        first();
        second();
    }
}

/// Leaves of the left half: full nodes, and half of them.
fn left_leaves(leaves: usize) -> usize {
    let mut unit = 1;
    while unit * CHILDREN < leaves {
        unit *= CHILDREN;
    }
    leaves.div_ceil(unit).div_ceil(2) * unit
}

/// Moves the `middle` photons with the smallest coordinates along the longest side of the box before the others.
struct Halve<'a, 'b, 'c> {
    data: &'a mut Columns<'b>,
    spare: &'a mut Columns<'c>,
    count: usize,
    middle: usize,
}

impl SimdWork for Halve<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { data, spare, count, middle } = self;
        let [x, y, z, _] = &data.0;
        let bounds = [bounds(lanes, &x[..count]), bounds(lanes, &y[..count]), bounds(lanes, &z[..count])];
        let extent = |axis: usize| bounds[axis][1] - bounds[axis][0];
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| extent(b).total_cmp(&extent(a)));
        if extent(axes[0]) <= 0.0 {
            return; // all in one place
        }
        let cut = cut(lanes, data.blocks(axes[0]), middle, bounds[axes[0]], count);
        let mut sides = LeftHalf {
            axes: [axes[0], axes[1]],
            less_than: cut.value,
            at_most: cut.value,
            tie: f32::NEG_INFINITY,
            room: middle - cut.less,
        };
        if cut.equal == sides.room {
            sides.less_than = cut.value.next_up();
        } else {
            // Photons of one plane share a coordinate: those on the cut are parted along the second axis.
            let tied = collect_tied(lanes, data, &sides, &mut *spare.0[0]);
            let around = self::bounds(lanes, &tied[..cut.equal]);
            let second = self::cut(lanes, tied.as_chunks().0, sides.room, around, cut.equal);
            sides.tie = second.value;
            sides.room -= second.less;
        }
        partition(lanes, data, spare, sides);
    }
}

/// Which photons belong to the left half.
struct LeftHalf {
    axes: [usize; 2],
    /// Along the first axis: left.
    less_than: f32,
    /// Along the first axis: on the cut, if not left.
    at_most: f32,
    /// Of those on the cut, left are the ones less than this along the second axis.
    tie: f32,
    /// And so many that are equal to it, first come, first served.
    room: usize,
}

impl LeftHalf {
    #[inline(always)]
    fn left<L: Lanes>(&mut self, lanes: L, data: &Columns<'_>, block: usize) -> Mask {
        let first = lanes.load(&data.blocks(self.axes[0])[block]);
        let left = lanes.less(first, lanes.splat(self.less_than));
        let on_cut = lanes.at_most(first, lanes.splat(self.at_most)) & !left;
        if on_cut == 0 {
            return left;
        }
        let second = lanes.load(&data.blocks(self.axes[1])[block]);
        let less = on_cut & lanes.less(second, lanes.splat(self.tie));
        let mut equal = on_cut & lanes.at_most(second, lanes.splat(self.tie)) & !less;
        while equal.count_ones() as usize > self.room {
            equal &= !(1 << (Mask::BITS - 1 - equal.leading_zeros()));
        }
        self.room -= equal.count_ones() as usize;
        left | less | equal
    }
}

/// Second coordinates of the photons on the cut, filled up with +∞ to whole vectors.
#[inline(always)]
fn collect_tied<'a, L: Lanes>(lanes: L, data: &Columns<'_>, sides: &LeftHalf, room: &'a mut [f32]) -> &'a [f32] {
    let cut = lanes.splat(sides.at_most);
    let mut count = 0;
    for (first, second) in data.blocks(sides.axes[0]).iter().zip(data.blocks(sides.axes[1])) {
        let first = lanes.load(first);
        let mask = lanes.at_most(first, cut) & !lanes.less(first, cut);
        if let Some(free) = room[count..].first_chunk_mut() {
            lanes.store(lanes.compress(mask, lanes.load(second)), free);
        }
        count += mask.count_ones() as usize;
    }
    let whole = count.next_multiple_of(LANES);
    room[count..whole].fill(f32::INFINITY);
    &room[..whole]
}

/// Smallest and largest of some numbers.
#[inline(always)]
fn bounds<L: Lanes>(lanes: L, numbers: &[f32]) -> [f32; 2] {
    let (blocks, rest) = numbers.as_chunks();
    let (mut low, mut high) = (lanes.splat(f32::INFINITY), lanes.splat(f32::NEG_INFINITY));
    for block in blocks {
        let block = lanes.load(block);
        (low, high) = (lanes.min(low, block), lanes.max(high, block));
    }
    let (mut lows, mut highs) = ([0.0; LANES], [0.0; LANES]);
    lanes.store(low, &mut lows);
    lanes.store(high, &mut highs);
    let smallest = lows.iter().chain(rest).copied().fold(f32::INFINITY, f32::min);
    [smallest, highs.iter().chain(rest).copied().fold(f32::NEG_INFINITY, f32::max)]
}

/// A value, and how many numbers are less than it and equal to it.
struct MedianCut {
    value: f32,
    less: usize,
    equal: usize,
}

/// The k-th smallest of `count` numbers between `low` and `high`.
#[inline(always)]
fn cut<L: Lanes>(lanes: L, blocks: &[[f32; LANES]], k: usize, [low, high]: [f32; 2], count: usize) -> MedianCut {
    let bracket = Bracket { low: low.next_down(), below: 0, high, upto: count };
    let value = kth_smallest(lanes, blocks, k, bracket).value;
    let [less, upto] = count_at_most(lanes, blocks, [value.next_down(), value]);
    MedianCut { value, less, equal: upto - less }
}

/// Moves the photons of the left side before the others; either side keeps its order.
#[inline(always)]
fn partition<L: Lanes>(lanes: L, data: &mut Columns<'_>, spare: &mut Columns<'_>, mut sides: LeftHalf) {
    let (mut left, mut right) = (0, 0);
    for block in 0..data.0[0].len() / LANES {
        let mask = sides.left(lanes, data, block);
        for (column, spare) in data.0.iter_mut().zip(&mut spare.0) {
            let numbers = lanes.load(&column.as_chunks().0[block]);
            // The left ones overwrite what has been read, the right ones wait aside.
            if let (Some(to), Some(aside)) = (column[left..].first_chunk_mut(), spare[right..].first_chunk_mut()) {
                lanes.store(lanes.compress(mask, numbers), to);
                lanes.store(lanes.compress(!mask, numbers), aside);
            }
        }
        left += mask.count_ones() as usize;
        right += mask.count_zeros() as usize;
    }
    for (column, spare) in data.0.iter_mut().zip(&spare.0) {
        column[left..].copy_from_slice(&spare[..right]);
    }
}

/// The nodes above the leaves, the lowest level first and the root last.
fn nodes(leaves: &[Leaf], count: usize) -> (Vec<Node>, Vec<NodeLevel>) {
    let mut boxes: Vec<NodeBox> = leaves
        .par_iter()
        .enumerate()
        .with_min_len(TASK / LEAF)
        .map(|(index, leaf)| NodeBox::of_leaf(leaf, (count - index * LEAF).min(LEAF)))
        .collect();
    let (mut nodes, mut levels) = (Vec::new(), Vec::new());
    while levels.is_empty() || boxes.len() > TOPS {
        levels.push(NodeLevel { first: nodes.len() as u32, children: boxes.len() as u32 });
        nodes.extend(boxes.chunks(CHILDREN).map(NodeBox::node));
        boxes = boxes.chunks(CHILDREN).map(NodeBox::around).collect();
    }
    (nodes, levels)
}

/// The box of some photons, m, and the area each of them has, m².
#[derive(Clone, Copy)]
struct NodeBox {
    low: [f32; 3],
    high: [f32; 3],
    per_photon: f32,
}

impl NodeBox {
    fn of_leaf(leaf: &Leaf, count: usize) -> Self {
        let end = |axis: usize, pick: fn(f32, f32) -> f32, start: f32| {
            leaf.0[VECTORS * axis..][..VECTORS].as_flattened()[..count].iter().copied().fold(start, pick)
        };
        let low = [0, 1, 2].map(|axis| end(axis, |a, b| if b < a { b } else { a }, f32::INFINITY));
        let high = [0, 1, 2].map(|axis| end(axis, |a, b| if b > a { b } else { a }, f32::NEG_INFINITY));
        let mut sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        sides.sort_by(f32::total_cmp);
        let [_, second, first] = sides;
        // Photons on a line share the squares they can fill.
        let area = first * second.max(first / count as f32);
        Self { low, high, per_photon: area / count as f32 }
    }

    fn around(parts: &[Self]) -> Self {
        let end =
            |start: f32, pick: fn(f32, f32) -> f32, of: &dyn Fn(&Self) -> f32| parts.iter().map(of).fold(start, pick);
        // The median: a box that spans floor and ceiling says nothing of either.
        let mut areas: Vec<f32> = parts.iter().map(|part| part.per_photon).collect();
        let (_, &mut per_photon, _) = areas.select_nth_unstable_by(parts.len() / 2, f32::total_cmp);
        Self {
            low: std::array::from_fn(|axis| end(f32::INFINITY, f32::min, &|part| part.low[axis])),
            high: std::array::from_fn(|axis| end(f32::NEG_INFINITY, f32::max, &|part| part.high[axis])),
            per_photon,
        }
    }

    fn node(children: &[Self]) -> Node {
        let (mut low, mut high) = ([[f32::INFINITY; CHILDREN]; 3], [[f32::NEG_INFINITY; CHILDREN]; 3]);
        for (lane, child) in children.iter().enumerate() {
            for axis in 0..3 {
                (low[axis][lane], high[axis][lane]) = (child.low[axis], child.high[axis]);
            }
        }
        Node { low, high, per_photon: Self::around(children).per_photon }
    }
}
