//! Compact form of the pattern of a sparse symmetric matrix, for comparison and for storage.

use nalgebra_sparse::pattern::SparsityPattern;

/// Pattern of entries in 32-bit indices, by square blocks of `block` where all of its blocks are
/// full.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct CompactPattern {
    pub(super) rows: u64,
    pub(super) block: u32,
    /// Number of entries up to the end of each column of blocks.
    pub(super) ends: Vec<u32>,
    pub(super) indices: Vec<u32>,
}

impl CompactPattern {
    pub fn new(pattern: &SparsityPattern) -> Self {
        Self::from_blocks(pattern, 3).unwrap_or_else(|| Self {
            rows: pattern.minor_dim() as u64,
            block: 1,
            ends: pattern.major_offsets()[1..]
                .iter()
                .map(|&e| e as u32)
                .collect(),
            indices: pattern.minor_indices().iter().map(|&i| i as u32).collect(),
        })
    }

    /// Pattern by blocks; `None` where some block is not full.
    fn from_blocks(pattern: &SparsityPattern, block: usize) -> Option<Self> {
        let (rows, columns) = (pattern.minor_dim(), pattern.major_dim());
        if !rows.is_multiple_of(block) || !columns.is_multiple_of(block) {
            return None;
        }
        let (mut ends, mut indices) = (Vec::with_capacity(columns / block), Vec::new());
        for node in 0..columns / block {
            let first = pattern.lane(block * node);
            let same = |other: usize| pattern.lane(block * node + other) == first;
            let is_full = |b: &[usize]| {
                b.len() == block
                    && b[0].is_multiple_of(block)
                    && b.windows(2).all(|w| w[1] == w[0] + 1)
            };
            if !(1..block).all(same) || !first.chunks(block).all(is_full) {
                return None;
            }
            indices.extend(first.iter().step_by(block).map(|&i| (i / block) as u32));
            ends.push(indices.len() as u32);
        }
        Some(Self {
            rows: rows as u64,
            block: block as u32,
            ends,
            indices,
        })
    }

    pub fn unpacked(&self) -> Result<SparsityPattern, &'static str> {
        let block = self.block as usize;
        let (mut offsets, mut indices, mut start) = (vec![0], Vec::new(), 0);
        for &end in &self.ends {
            let blocks = self
                .indices
                .get(start..end as usize)
                .ok_or("a torn pattern")?;
            start = end as usize;
            let lane = || blocks.iter().map(|&b| block * b as usize);
            for _ in 0..block {
                indices.extend(lane().flat_map(|i| i..i + block));
                offsets.push(indices.len());
            }
        }
        let (columns, rows) = (offsets.len() - 1, self.rows as usize);
        SparsityPattern::try_from_offsets_and_indices(columns, rows, offsets, indices)
            .map_err(|_| "a pattern whose indices do not ascend")
    }
}
