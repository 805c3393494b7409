//! Matrices and factors in a form that reads back to the last bit, for serde: numbers as bytes of
//! this machine, indices in 32 bits.
//!
//! The modules are for `#[serde(with = "...")]`. A [`Cholesky`] is stored as its values, its order
//! and the pattern of the matrix. The symbolic analysis, which follows from these two, is repeated.

use std::sync::Arc;

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};

use super::factor::Cholesky;
use super::pattern::CompactPattern;
use super::symbolic::Symbolic;

/// Writes a value that is shared.
///
/// # Errors
/// The errors of the serializer.
pub fn shared<T: Serialize, S: Serializer>(
    value: &Arc<T>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    T::serialize(value, serializer)
}

/// Numbers that are written as bytes.
struct Bytes<'a, T>(&'a [T]);

impl<T: bytemuck::NoUninit> Serialize for Bytes<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(bytemuck::cast_slice(self.0))
    }
}

/// Numbers that are read from the bytes of [`Bytes`].
struct Owned<T>(Vec<T>);

impl<'de, T: bytemuck::AnyBitPattern> Deserialize<'de> for Owned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfBytes<T>(std::marker::PhantomData<T>);
        impl<T: bytemuck::AnyBitPattern> Visitor<'_> for OfBytes<T> {
            type Value = Owned<T>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("whole numbers of bytes")
            }
            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Owned<T>, E> {
                let size = size_of::<T>();
                if !bytes.len().is_multiple_of(size) {
                    return Err(E::invalid_length(bytes.len(), &self));
                }
                let numbers = bytes.chunks_exact(size);
                Ok(Owned(numbers.map(bytemuck::pod_read_unaligned).collect()))
            }
        }
        deserializer.deserialize_bytes(OfBytes(std::marker::PhantomData))
    }
}

/// Storage of a `Vec` of plain numbers, such as `f64` or `u8`.
pub mod numbers {
    use super::*;

    /// Writes the numbers as they are in memory.
    ///
    /// # Errors
    /// The errors of the serializer.
    pub fn serialize<T: bytemuck::NoUninit, S: Serializer>(
        values: &[T],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        Bytes(values).serialize(serializer)
    }

    /// Reads numbers that [`serialize`] wrote.
    ///
    /// # Errors
    /// The errors of the deserializer, and bytes that do not make whole numbers.
    pub fn deserialize<'de, T: bytemuck::AnyBitPattern, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<T>, D::Error> {
        Ok(Owned::deserialize(deserializer)?.0)
    }
}

/// Storage of a `Mat<f64>`.
pub mod matrix {
    use super::*;

    /// Writes shape and entries.
    ///
    /// # Errors
    /// The errors of the serializer.
    pub fn serialize<S: Serializer>(a: &Mat<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        let columns = (0..a.ncols()).flat_map(|j| a.col_as_slice(j));
        let values: Vec<f64> = columns.copied().collect();
        (a.nrows() as u64, a.ncols() as u64, Bytes(&values)).serialize(serializer)
    }

    /// Reads a matrix that [`serialize`] wrote.
    ///
    /// # Errors
    /// The errors of the deserializer, and numbers that do not fit together.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Mat<f64>, D::Error> {
        let (rows, columns, values): (u64, u64, Owned<f64>) =
            Deserialize::deserialize(deserializer)?;
        if rows.checked_mul(columns) != Some(values.0.len() as u64) {
            return Err(D::Error::custom("a matrix of another size than its values"));
        }
        let (rows, columns) = (rows as usize, columns as usize);
        Ok(MatRef::from_column_major_slice(&values.0, rows, columns).to_owned())
    }
}

/// Storage of a `CscMatrix<f64>`.
pub mod sparse_matrix {
    use super::*;

    /// Writes pattern and values.
    ///
    /// # Errors
    /// The errors of the serializer.
    pub fn serialize<S: Serializer>(a: &CscMatrix<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        (CompactPattern::new(a.pattern()), Bytes(a.values())).serialize(serializer)
    }

    /// Reads a matrix that [`serialize`] wrote.
    ///
    /// # Errors
    /// The errors of the deserializer, and numbers that do not fit together.
    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<CscMatrix<f64>, D::Error> {
        let (pattern, values): (CompactPattern, Owned<f64>) =
            Deserialize::deserialize(deserializer)?;
        let pattern = pattern.unpacked().map_err(D::Error::custom)?;
        CscMatrix::try_from_pattern_and_values(pattern, values.0)
            .map_err(|_| D::Error::custom("a sparse matrix of another pattern than its values"))
    }
}

impl Serialize for CompactPattern {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let whole = (
            self.rows,
            self.block,
            Bytes(&self.ends),
            Bytes(&self.indices),
        );
        whole.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for CompactPattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (rows, block, ends, indices): (u64, u32, Owned<u32>, Owned<u32>) =
            Deserialize::deserialize(deserializer)?;
        Ok(Self {
            rows,
            block,
            ends: ends.0,
            indices: indices.0,
        })
    }
}

impl Serialize for Cholesky {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let order = self.symbolic().permutation().0;
        let order: Vec<u32> = order.iter().map(|&i| i as u32).collect();
        let mut parts = serializer.serialize_tuple(3)?;
        parts.serialize_element(self.symbolic().pattern())?;
        parts.serialize_element(&Bytes(&order))?;
        parts.serialize_element(&Bytes(self.values()))?;
        parts.end()
    }
}

impl<'de> Deserialize<'de> for Cholesky {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (pattern, order, values): (CompactPattern, Owned<u32>, Owned<f64>) =
            Deserialize::deserialize(deserializer)?;
        let pattern = pattern.unpacked().map_err(D::Error::custom)?;
        let order = order.0.into_iter().map(|i| i as usize).collect();
        let symbolic = Symbolic::from_order(&pattern, order).map_err(D::Error::custom)?;
        Cholesky::from_values(symbolic, values.0)
            .ok_or_else(|| D::Error::custom("a factor of another size than its values"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::lattice::{Lattice, scattered};

    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    struct All {
        #[serde(with = "numbers")]
        numbers: Vec<f64>,
        #[serde(with = "matrix")]
        matrix: Mat<f64>,
        #[serde(with = "sparse_matrix")]
        sparse: CscMatrix<f64>,
    }

    #[test]
    fn everything_reads_back_to_the_bit() {
        let lattice = Lattice::new([5, 4, 3], 3e7, 0.2, 0.4);
        let (k, _) = lattice.cantilever();
        // Rows and columns of another number, not in blocks.
        let ragged = CscMatrix::try_from_csc_data(
            4,
            2,
            vec![0, 2, 3],
            vec![1, 3, 0],
            vec![0.1, -0.0, 5e-324],
        );
        for sparse in [k, ragged.unwrap(), CscMatrix::zeros(0, 3)] {
            let all = All {
                numbers: vec![0.1, -0.0, f64::MIN_POSITIVE, 1.0 / 3.0],
                matrix: Mat::from_fn(7, 3, |i, j| scattered(i + 9 * j)),
                sparse,
            };
            let bytes = postcard::to_stdvec(&all).unwrap();
            assert_eq!(postcard::from_bytes::<All>(&bytes).unwrap(), all);
            for cut in [0, 1, bytes.len() / 2, bytes.len() - 1] {
                assert!(postcard::from_bytes::<All>(&bytes[..cut]).is_err());
            }
        }
    }

    #[test]
    fn a_factor_that_was_read_back_solves_to_the_same_bits() {
        let lattice = Lattice::new([6, 4, 4], 3e7, 0.2, 0.4);
        let (k, _) = lattice.cantilever();
        let factor = Cholesky::factor(&k).unwrap();
        let bytes = postcard::to_stdvec(&factor).unwrap();
        let back: Cholesky = postcard::from_bytes(&bytes).unwrap();
        let n = factor.symbolic().unknowns();
        let mut x = Mat::from_fn(n, 40, |i, j| scattered(i + n * j));
        let mut y = x.clone();
        factor.solve_in_place(x.as_mut());
        back.solve_in_place(y.as_mut());
        assert_eq!(x, y);
        assert!(x.norm_max() > 0.0);
        let nothing = Cholesky::factor(&CscMatrix::zeros(0, 0)).unwrap();
        let bytes = postcard::to_stdvec(&nothing).unwrap();
        assert_eq!(
            postcard::from_bytes::<Cholesky>(&bytes)
                .unwrap()
                .symbolic()
                .unknowns(),
            0
        );
    }
}
