//! What is known of a node while the pyramid is built, and how nodes are merged into their parent.

use super::pyramid::Node;

/// Running sums of one node; means over its real voxels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// Real voxels.
    pub count: f32,
    /// Those among them that `appearance` is the mean of.
    pub weight: f32,
    /// Mean of what deviates: (opacity, opacity · rgb) of a voxel one voxel thick, or (value, 0, 0, 0)
    /// as a part of the volume's range.
    pub appearance: [f32; 4],
    /// Sum of squared deviations from `appearance`, over voxels and components.
    pub m2: f32,
    /// Mean extinction · rgb, and extinction.
    pub emission: [f32; 4],
    /// Extinction of equal mean transmittance.
    pub effective: f32,
    /// Greatest error of a descendant.
    pub error: f32,
}

/// A classified voxel, one voxel thick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Voxel {
    /// (opacity, opacity · rgb).
    pub appearance: [f32; 4],
    /// Extinction · rgb, and extinction.
    pub emission: [f32; 4],
}

impl Voxel {
    /// Nothing shows.
    pub(super) const CLEAR: Self = Self { appearance: [0.0; 4], emission: [0.0; 4] };

    /// Of a table's entry; `voxel_depth` is the voxel's thickness in opacity unit distances.
    pub(super) fn new([r, g, b, extinction]: [f32; 4], voxel_depth: f32) -> Self {
        let alpha = -(-extinction * voxel_depth).exp_m1();
        Self {
            appearance: [alpha, alpha * r, alpha * g, alpha * b],
            emission: [extinction * r, extinction * g, extinction * b, extinction],
        }
    }

    pub(super) fn extinction(&self) -> f32 {
        self.emission[3]
    }

    /// As a node of its own, whose values deviate as the classified ones do.
    pub(super) fn sums(&self) -> Sums {
        let Self { appearance, emission } = *self;
        let (effective, one) = (emission[3], 1.0);
        Sums { count: one, weight: one, appearance, emission, effective, ..Sums::default() }
    }
}

impl Sums {
    /// Of so many voxels of which nothing shows.
    pub(super) fn clear(voxels: usize) -> Self {
        let count = voxels as f32;
        Self { count, weight: count, ..Self::default() }
    }

    /// Chan's merge of counts, means and M2: stable however small the spread.
    pub(super) fn merge(&mut self, other: &Self) {
        if self.count == 0.0 {
            *self = *other;
            return;
        }
        let count = self.count + other.count;
        if other.weight > 0.0 {
            let weight = other.weight / (self.weight + other.weight);
            let mut squared = 0.0;
            for (mean, theirs) in self.appearance.iter_mut().zip(other.appearance) {
                let delta = theirs - *mean;
                *mean += delta * weight;
                squared += delta * delta;
            }
            self.m2 += other.m2 + squared * self.weight * weight;
            self.weight += other.weight;
        }
        let weight = other.count / count;
        for (mean, theirs) in self.emission.iter_mut().zip(other.emission) {
            *mean += (theirs - *mean) * weight;
        }
        self.error = self.error.max(other.error);
        self.count = count;
    }

    /// Eight voxels merged one after the other: what [`Sums::merge`] makes of them, in a third of the
    /// time.
    pub(super) fn of_eight(voxels: &[Voxel; 8], voxel_depth: f32) -> Self {
        let [first, others @ ..] = voxels;
        let Voxel { mut appearance, mut emission } = *first;
        let (mut m2, mut count) = (0.0_f32, 1.0_f32);
        for voxel in others {
            let weight = 1.0 / (count + 1.0);
            let mut squared = 0.0;
            for (mean, theirs) in appearance.iter_mut().zip(voxel.appearance) {
                let delta = theirs - *mean;
                *mean += delta * weight;
                squared += delta * delta;
            }
            m2 += squared * count * weight;
            for (mean, theirs) in emission.iter_mut().zip(voxel.emission) {
                *mean += (theirs - *mean) * weight;
            }
            count += 1.0;
        }
        let mut extinctions = [0.0; 8];
        for (extinction, voxel) in extinctions.iter_mut().zip(voxels) {
            *extinction = voxel.extinction();
        }
        let effective = effective_of_eight(extinctions, voxel_depth);
        let mut sums =
            Self { count, weight: count, appearance, m2, emission, effective, error: 0.0 };
        sums.error = sums.rms();
        sums
    }

    /// The parent of up to eight nodes, in x, y, z bit order; those beyond the border are `None`.
    /// `child_depth` is the thickness of a child in opacity unit distances, `edge` the parent's edge over
    /// that of a node of level 1. Also how many of them show.
    pub(super) fn parent(children: [Option<&Self>; 8], child_depth: f32, edge: f32) -> (Self, u16) {
        let mut merged = Self::default();
        let mut active = 0;
        for child in children.into_iter().flatten() {
            active += u16::from(child.effective > 0.0);
            merged.merge(child);
        }
        if active > 0 {
            let effective = children.map(|child| child.map(|child| child.effective));
            merged.effective = effective_extinction(&effective, child_depth);
            merged.error = merged.error.max(merged.rms() * edge);
        }
        (merged, active)
    }

    /// Root mean square deviation of the appearance.
    pub(super) fn rms(&self) -> f32 {
        (self.m2 / self.weight.max(1.0)).max(0.0).sqrt()
    }

    /// What is drawn of it.
    pub(super) fn node(&self, active_children: u16) -> Node {
        let [r, g, b, extinction] = self.emission;
        let weight = if extinction > 0.0 { 1.0 / extinction } else { 0.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=65535")]
        let colour = [r, g, b].map(|e| ((e * weight).clamp(0.0, 1.0) * 65535.0 + 0.5) as u16);
        Node { extinction: self.effective, error: self.error, colour, active_children }
    }
}

/// Extinction whose transmittance through the node equals the mean over its columns of children,
/// averaged over the three axes (−ln⟨exp(−column depth)⟩ / size).
///
/// `children` are in x, y, z bit order; absent ones (beyond the border) are `None`. `size` is the
/// thickness of a child in unit distances.
pub(super) fn effective_extinction(children: &[Option<f32>; 8], size: f32) -> f32 {
    if let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f), Some(g), Some(h)] = *children {
        return effective_of_eight([a, b, c, d, e, f, g, h], size);
    }
    let mut present = children.iter().flatten();
    let Some(&first) = present.next() else { return 0.0 };
    if present.all(|&c| c == first) {
        return first;
    }
    let mut axes = 0.0;
    let mut mean = 0.0;
    for axis in 0..3 {
        let step = 1 << axis;
        let mut depths = [f32::INFINITY; 4];
        let (mut columns, mut longest) = (0, 0.0_f32);
        for start in (0..8).filter(|i| i & step == 0) {
            let pair = [children[start], children[start | step]];
            let length = pair.iter().flatten().count();
            if length == 0 {
                continue;
            }
            depths[columns] = pair.iter().flatten().sum::<f32>() * size;
            columns += 1;
            longest = longest.max(length as f32);
        }
        if columns > 0 {
            mean += column_depth(&depths[..columns]) / (size * longest);
            axes += 1.0;
        }
    }
    mean / axes
}

/// The same where all eight children are there.
fn effective_of_eight(children: [f32; 8], size: f32) -> f32 {
    let first = children[0];
    if children.iter().all(|&c| c == first) {
        return first;
    }
    let [a, b, c, d, e, f, g, h] = children;
    let mut mean = 0.0;
    for pairs in [
        [(a, b), (c, d), (e, f), (g, h)],
        [(a, c), (b, d), (e, g), (f, h)],
        [(a, e), (b, f), (c, g), (d, h)],
    ] {
        let mut depths = [0.0; 4];
        for (depth, (near, far)) in depths.iter_mut().zip(pairs) {
            *depth = (near + far) * size;
        }
        mean += column_depth(&depths) / (size * 2.0);
    }
    mean / 3.0
}

/// −ln of the mean transmittance of columns of these optical depths.
fn column_depth(depths: &[f32]) -> f32 {
    // Relative to the least: exp(−104) is 0 in single precision, and its logarithm −∞.
    let least = depths.iter().copied().fold(f32::INFINITY, f32::min);
    let beyond: f32 =
        depths.iter().map(|&depth| if depth == least { 1.0 } else { (least - depth).exp() }).sum();
    least - (beyond / depths.len() as f32).ln()
}
