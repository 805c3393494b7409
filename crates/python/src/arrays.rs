//! Arrays for results, and checks of the arrays that are given.

use numpy::{
    Complex64, Element, PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors;
use dovetail_numerics::spectrum::Spectrum;

/// Array of one dimension.
pub fn vector<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values)
}

/// Array of rows and columns, whose values stand row after row.
pub fn table<T: Element>(
    py: Python<'_>,
    shape: [usize; 2],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Array of three dimensions, whose values stand in the order of their indices.
pub fn block<T: Element>(
    py: Python<'_>,
    shape: [usize; 3],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray3<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Array of vectors in space, (n, 3).
pub fn vector_array<'py>(
    py: Python<'py>,
    vectors: &[[f64; 3]],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    table(py, [vectors.len(), 3], vectors.concat())
}

/// Complex amplitudes of n signals, (H+1) n, harmonic after harmonic, from their 2H+1 blocks of
/// coefficients: c_0 is the mean, and the signal is the real part of the sum of c_k exp(i k w t).
pub fn amplitudes(coefficients: &[f64], harmonics: usize) -> Vec<Complex64> {
    let of = Spectrum::new(coefficients, harmonics);
    let mut out: Vec<Complex64> = of.mean().iter().map(|v| Complex64::new(*v, 0.0)).collect();
    for k in 1..=harmonics {
        let parts = of.cosine(k).iter().zip(of.sine(k));
        out.extend(parts.map(|(c, s)| Complex64::new(*c, -*s)));
    }
    out
}

/// Numbers of an array or a list, with its shape.
#[derive(Debug)]
pub struct Given<T> {
    pub shape: Vec<usize>,
    pub values: Vec<T>,
}

/// numpy's array of `given`, and the kind and size of its numbers.
fn array_of<'py>(given: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyAny>, String, usize)> {
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,))?;
    let dtype = array.getattr("dtype")?;
    let kind = dtype.getattr("kind")?.extract()?;
    let size = dtype.getattr("itemsize")?.extract()?;
    Ok((array, kind, size))
}

fn contiguous<T: Element + Copy>(array: &Bound<'_, PyAny>, dtype: &str) -> PyResult<Given<T>> {
    let numpy = array.py().import("numpy")?;
    // A single number stays one: `ascontiguousarray` makes a vector of it.
    let array = numpy.call_method1("asarray", (array, dtype, "C"))?;
    let array = array.cast::<PyArrayDyn<T>>()?.readonly();
    Ok(Given {
        shape: array.shape().to_vec(),
        values: array.as_slice()?.to_vec(),
    })
}

fn wrong_kind(name: &str, kind: &str, size: usize) -> PyErr {
    PyTypeError::new_err(match kind {
        "c" => format!("{name} is complex, and has to be real: give its real part, or float64"),
        "f" if size < 8 => format!(
            "{name} has {} bits a number (float{0}), and has to be of double precision: give float64, as by \
             numpy.asarray({name}, dtype=float) from data that have the digits",
            8 * size
        ),
        "f" => format!(
            "{name} is longer than double precision: give float64, as by {name}.astype(float)"
        ),
        _ => format!("{name} has to be an array of numbers (float64)"),
    })
}

fn check_all_finite(name: &str, values: &[f64]) -> PyResult<()> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(at) => Err(errors::value(format!(
            "{name} has a number that is not finite: {} at entry {at}",
            values[at]
        ))),
    }
}

/// Real numbers of double precision; whole numbers are taken as such.
pub fn reals(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Given<f64>> {
    let (array, kind, size) = array_of(given)?;
    match (kind.as_str(), size) {
        ("f", 8) | ("i" | "u", _) => {}
        (kind, size) => return Err(wrong_kind(name, kind, size)),
    }
    let array = contiguous::<f64>(&array, "float64")?;
    check_all_finite(name, &array.values)?;
    Ok(array)
}

/// Real or complex numbers of double precision.
pub fn complexes(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Given<Complex64>> {
    let (array, kind, size) = array_of(given)?;
    match (kind.as_str(), size) {
        ("f", 8) | ("c", 16) | ("i" | "u", _) => {}
        ("c", _) => {
            return Err(PyTypeError::new_err(format!(
                "{name} has {} bits a number, and has to be of double precision: give complex128",
                8 * size
            )));
        }
        (kind, size) => return Err(wrong_kind(name, kind, size)),
    }
    let array = contiguous::<Complex64>(&array, "complex128")?;
    let parts: Vec<f64> = array.values.iter().flat_map(|v| [v.re, v.im]).collect();
    check_all_finite(name, &parts)?;
    Ok(array)
}

/// Checks the shape of an array.
pub fn has_shape(name: &str, shape: &[usize], expected: &[usize]) -> PyResult<()> {
    if shape == expected {
        return Ok(());
    }
    let words = |shape: &[usize]| {
        let sizes: Vec<String> = shape.iter().map(ToString::to_string).collect();
        match &sizes[..] {
            [one] => format!("({one},)"),
            more => format!("({})", more.join(", ")),
        }
    };
    Err(errors::value(format!(
        "{name} has the shape {}, and has to have the shape {}",
        words(shape),
        words(expected)
    )))
}

/// Real vector of a length.
pub fn real_vector(name: &str, given: &Bound<'_, PyAny>, length: usize) -> PyResult<Vec<f64>> {
    let Given { shape, values } = reals(name, given)?;
    has_shape(name, &shape, &[length])?;
    Ok(values)
}
