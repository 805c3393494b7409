//! Binary files made here, word by word, in what no writer at hand makes: both byte orders, long
//! words, small types; and with one fault each.

use std::io::Write as _;
use std::path::Path;

use dovetail_matrices::{FileMatrices, MatrixError, MatrixQuantity, NamedMatrix, parse};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use nalgebra_sparse::na::DMatrix;

/// Writer of words in one byte order.
#[derive(Clone, Copy)]
struct Order {
    is_big: bool,
}

const BOTH: [Order; 2] = [Order { is_big: false }, Order { is_big: true }];

impl Order {
    fn bytes<const N: usize>(self, mut little: [u8; N]) -> Vec<u8> {
        if self.is_big {
            little.reverse();
        }
        little.to_vec()
    }

    fn u32(self, word: u32) -> Vec<u8> {
        self.bytes(word.to_le_bytes())
    }

    fn f64(self, value: f64) -> Vec<u8> {
        self.bytes(value.to_le_bytes())
    }

    fn f64s(self, values: &[f64]) -> Vec<u8> {
        values.iter().flat_map(|value| self.f64(*value)).collect()
    }

    /// Record of Fortran.
    fn record(self, content: &[u8]) -> Vec<u8> {
        let marker = self.u32(content.len() as u32);
        [&marker[..], content, &marker].concat()
    }

    /// Element of a file of Matlab.
    fn element(self, kind: u32, data: &[u8]) -> Vec<u8> {
        let mut element = [self.u32(kind), self.u32(data.len() as u32), data.to_vec()].concat();
        element.resize(element.len().next_multiple_of(8), 0);
        element
    }
}

fn all(file: &str, bytes: &[u8]) -> Result<Vec<NamedMatrix>, MatrixError> {
    parse(Path::new(file), bytes).and_then(FileMatrices::read_all)
}

fn read(bytes: &[u8]) -> NamedMatrix {
    let mut matrices = all("a", bytes).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(matrices.len(), 1);
    matrices.remove(0)
}

#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) {
    let Err(error) = all("k.bin", bytes) else {
        panic!("it is read, not refused: {words:?}");
    };
    let message = error.to_string();
    for words in words.iter().chain(&["k.bin"]) {
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// File of OUTPUT4 with the matrix [4 -1; -1 5] in words of 4 or 8 bytes.
fn op4(order: Order, is_long: bool, kind: i64, is_sparse: bool) -> Vec<u8> {
    let word = |n: i64| match is_long {
        true => order.bytes(n.to_le_bytes()),
        false => order.bytes((n as i32).to_le_bytes()),
    };
    let words = |list: &[i64]| list.iter().flat_map(|n| word(*n)).collect::<Vec<u8>>();
    let value = |value: f64| match (kind, is_long) {
        (1, false) => order.bytes((value as f32).to_le_bytes()),
        _ => order.f64(value),
    };
    let of_a_value = if kind == 2 && !is_long { 2 } else { 1 };
    let rows = if is_sparse { -2 } else { 2 };
    let name = if is_long {
        &b"KAA             "[..]
    } else {
        b"KAA     "
    };
    let mut file = order.record(&[words(&[2, rows, 6, kind]), name.to_vec()].concat());
    for (column, values) in [(1, [4.0, -1.0]), (2, [-1.0, 5.0])] {
        let values = values.map(value).concat();
        let content = if is_sparse {
            let head = [column, 0, 2 * of_a_value + 2, 2 * of_a_value + 1, 1];
            [words(&head), values].concat()
        } else {
            [words(&[column, 1, 2 * of_a_value]), values].concat()
        };
        file.extend(order.record(&content));
    }
    file.extend(order.record(&[words(&[3, 1, 1]), value(1.0)].concat()));
    file
}

fn expected() -> DMatrix<f64> {
    DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 5.0])
}

#[test]
fn op4_files_have_words_of_two_lengths_in_two_orders() {
    for order in BOTH {
        for is_long in [false, true] {
            for (kind, is_sparse) in [(1, false), (1, true), (2, false), (2, true)] {
                let found = read(&op4(order, is_long, kind, is_sparse));
                assert_eq!(found.name.as_deref(), Some("KAA"));
                assert_eq!(DMatrix::from(&found.matrix), expected(), "{is_long} {kind}");
            }
        }
    }
}

#[test]
fn faults_of_op4_records_are_told_with_their_byte() {
    let order = BOTH[0];
    // The header has 32 bytes with its marks; of the first column the mark, three words and values.
    let whole = op4(order, false, 2, false);
    let with = |at: usize, bytes: &[u8]| {
        let mut changed = whole.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        changed
    };
    refused(
        &with(64, &[27]),
        &["byte 64: ", "found 27 behind a record", "length 28"],
    );
    refused(
        &with(48, &order.f64(f64::NAN)),
        &["byte 48: ", "NaN in `KAA`"],
    );
    refused(
        &with(40, &[2]),
        &["byte 48: ", "row 2 with the 2 values", "2 of the matrix"],
    );
    refused(&with(36, &[0]), &["byte 36: ", "column 0"]);
    refused(
        &with(8, &order.u32(900_000)),
        &["byte 4: ", "900000", "bytes"],
    );
    refused(&with(16, &[7]), &["byte 4: ", "type (1 to 4)"]);
    refused(&with(16, &[3]), &["`KAA` is complex"]);
    refused(&whole[..70], &["ends before", "the end of a matrix"]);
    let second = [&whole[..], &order.record(&[0; 20])].concat();
    refused(
        &second,
        &["a record of 20 bytes", "header of a matrix, of 24 bytes"],
    );
    let sparse = op4(order, false, 2, true);
    let mut changed = sparse.clone();
    changed[48] = 0;
    refused(&changed, &["byte 36: ", "a string of a sparse column"]);
}

/// Beginning of a file of Matlab.
fn mat_head(order: Order) -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file, made by a test".to_vec();
    file.resize(124, b' ');
    file.extend(order.bytes([0x00, 0x01]));
    file.extend(order.bytes(*b"IM"));
    file
}

/// File of Matlab with one variable `K` of a class.
fn mat(order: Order, class: u32, size: [u32; 2], parts: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let mut file = mat_head(order);
    let flags = order.element(6, &[order.u32(class), order.u32(0)].concat());
    let size = order.element(5, &size.map(|n| order.u32(n)).concat());
    // A short name stands in its tag.
    let name = [order.u32(1 | (1 << 16)), b"K\0\0\0".to_vec()].concat();
    let parts = parts
        .iter()
        .flat_map(|(kind, data)| order.element(*kind, data));
    let content: Vec<u8> = [flags, size, name]
        .concat()
        .into_iter()
        .chain(parts)
        .collect();
    file.extend(order.element(14, &content));
    file
}

const DENSE: u32 = 6;
const SPARSE: u32 = 5;

#[test]
fn mat_files_have_numbers_of_every_type_in_two_orders() {
    let values = [4i8, -1, -1, 5];
    for order in BOTH {
        let each = |bytes: &dyn Fn(i8) -> Vec<u8>| values.map(bytes).concat();
        for (kind, data) in [
            (1, each(&|v| vec![v as u8])),
            (3, each(&|v| order.bytes(i16::from(v).to_le_bytes()))),
            (5, each(&|v| order.bytes(i32::from(v).to_le_bytes()))),
            (12, each(&|v| order.bytes(i64::from(v).to_le_bytes()))),
            (7, each(&|v| order.bytes(f32::from(v).to_le_bytes()))),
            (9, each(&|v| order.f64(f64::from(v)))),
        ] {
            let found = read(&mat(order, DENSE, [2, 2], &[(kind, data)]));
            assert_eq!(found.name.as_deref(), Some("K"));
            assert_eq!(DMatrix::from(&found.matrix), expected(), "{kind}");
        }
        for (kind, bytes) in [(2, 1), (4, 2), (6, 4), (13, 8)] {
            let data: Vec<u8> = [250u64, 1, 1, 5]
                .into_iter()
                .flat_map(|v| match order.is_big {
                    true => v.to_be_bytes()[8 - bytes..].to_vec(),
                    false => v.to_le_bytes()[..bytes].to_vec(),
                })
                .collect();
            let found = read(&mat(order, DENSE, [2, 2], &[(kind, data)]));
            let expected = DMatrix::from_row_slice(2, 2, &[250.0, 1.0, 1.0, 5.0]);
            assert_eq!(DMatrix::from(&found.matrix), expected, "{kind}");
        }
    }
}

#[test]
fn faults_of_mat_files_are_told_with_their_byte() {
    let order = BOTH[0];
    let words = |list: &[u32]| list.iter().flat_map(|n| order.u32(*n)).collect::<Vec<u8>>();
    let dense = |size, values: &[f64]| mat(order, DENSE, size, &[(9, order.f64s(values))]);
    let sparse = |rows: &[u32], begin: &[u32], values: &[f64]| {
        let parts = [(5, words(rows)), (5, words(begin)), (9, order.f64s(values))];
        mat(order, SPARSE, [2, 2], &parts)
    };
    let found = read(&sparse(&[0, 1, 0, 1], &[0, 2, 4], &[4.0, -1.0, -1.0, 5.0]));
    assert_eq!(DMatrix::from(&found.matrix), expected());
    // The values begin at byte 184, behind header, tags, flags, size and name.
    refused(
        &dense([2, 2], &[1.0, f64::INFINITY, 1.0, 1.0]),
        &["byte 192: ", "inf in `K`"],
    );
    refused(
        &dense([2, 2], &[1.0, 2.0]),
        &["byte 184: ", "2 values of `K`", "2 x 2"],
    );
    refused(&dense([900_000, 1], &[1.0]), &["byte 184: ", "900000 x 1"]);
    refused(
        &sparse(&[0, 2], &[0, 1, 2], &[1.0, 1.0]),
        &["byte 188: ", "row 3 is outside the 2"],
    );
    refused(
        &sparse(&[0, 1], &[0, 2, 1], &[1.0, 1.0]),
        &["column 2 of `K`", "ascending"],
    );
    refused(
        &sparse(&[0, 1], &[0, 1, 3], &[1.0, 1.0]),
        &["column 2 of `K`", "up to 2"],
    );
    refused(
        &sparse(&[0, 1], &[0, 2], &[1.0, 1.0]),
        &["2 beginnings of columns of `K`"],
    );
    refused(
        &mat(order, DENSE, [1, 1], &[(14, Vec::new())]),
        &["data of the type 14"],
    );
    refused(
        &mat(order, DENSE, [1, 1], &[]),
        &["ends before", "values of a matrix"],
    );
    refused(
        &mat(order, 4, [1, 1], &[]),
        &["no matrix of real numbers", "`K` is text"],
    );
    refused(
        &mat(order, DENSE | 0x0800, [1, 1], &[]),
        &["`K` is complex"],
    );
    refused(&dense([1, 1], &[1.0])[..128], &["no variables"]);
    refused(
        &dense([1, 1], &[1.0])[..150],
        &["ends before", "a variable"],
    );
    let damaged = [
        &dense([1, 1], &[1.0])[..128],
        &order.element(15, b"no zlib"),
    ]
    .concat();
    refused(&damaged, &["byte 136: ", "compressed data"]);
}

/// File with one compressed variable `K`, a dense matrix whose columns are given one by one.
fn compressed(size: u32, column: impl Fn(u32) -> Vec<f64>) -> Vec<u8> {
    let order = BOTH[0];
    let head = mat(order, DENSE, [size, size], &[]);
    let head = &head[136..];
    let values = size * size * 8;
    let mut encoder = ZlibEncoder::new(mat_head(order), Compression::default());
    encoder
        .get_mut()
        .extend([order.u32(15), order.u32(0)].concat());
    let mut write = |bytes: &[u8]| encoder.write_all(bytes).unwrap();
    write(&[order.u32(14), order.u32(head.len() as u32 + 8 + values)].concat());
    write(head);
    write(&[order.u32(9), order.u32(values)].concat());
    (0..size).for_each(|j| write(&order.f64s(&column(j))));
    let mut file = encoder.finish().unwrap();
    let length = file.len() as u32 - 136;
    file[132..136].copy_from_slice(&order.u32(length));
    file
}

#[test]
fn a_compressed_file_takes_bounded_memory() {
    // 4 MB of zeros but for the diagonal, and 23 MB of the same value.
    let diagonal = compressed(700, |j| (0..700).map(|i| f64::from(i == j)).collect());
    assert!(diagonal.len() < 60_000, "{}", diagonal.len());
    let found = read(&diagonal);
    assert_eq!((found.matrix.nrows(), found.matrix.nnz()), (700, 700));
    let full = compressed(1700, |_| vec![2.5; 1700]);
    assert!(full.len() < 200_000, "{}", full.len());
    refused(&full, &["`K` becomes too large", "save -v6"]);
}

#[test]
fn objects_and_functions_are_left_out() {
    let order = BOTH[0];
    let matrix = mat(order, DENSE, [1, 1], &[(9, order.f64(2.0))]);
    let flags = |class: u32| order.element(6, &[order.u32(class), order.u32(0)].concat());
    // A table has no size; its name and the names of its kind follow the flags.
    let names = [&b"t"[..], b"MCOS", b"table"].map(|name| order.element(1, name));
    let table = order.element(14, &[flags(17), names.concat()].concat());
    // What Matlab keeps about objects is a variable without a name.
    let size = order.element(5, &[order.u32(1), order.u32(8)].concat());
    let data = [
        flags(9),
        size,
        order.element(1, b""),
        order.element(2, &[7; 8]),
    ]
    .concat();
    let data = order.element(14, &data);
    let file = [matrix, table.clone(), data].concat();
    let found = read(&file);
    assert_eq!(found.name.as_deref(), Some("K"));
    assert_eq!(found.matrix.values(), [2.0]);
    let found = parse(Path::new("t.mat"), &file).unwrap();
    let error = found
        .choose(MatrixQuantity::Stiffness, Some("t"))
        .unwrap_err();
    assert!(error.to_string().contains("`t` is an object"), "{error}");
    refused(&[mat_head(order), table].concat(), &["`t` is an object"]);
}

#[test]
fn a_matrix_with_a_fault_does_no_harm_to_those_behind_it() {
    let order = BOTH[0];
    let mut damaged = op4(order, false, 2, false);
    damaged[48..56].copy_from_slice(&order.f64(f64::NAN));
    let mut second = op4(order, false, 2, false);
    second[20..28].copy_from_slice(b"MAA     ");
    let file = [damaged, second].concat();
    let found = |quantity| {
        parse(Path::new("k.op4"), &file)
            .unwrap()
            .choose(quantity, None)
    };
    assert_eq!(
        DMatrix::from(&found(MatrixQuantity::Mass).unwrap().matrix),
        expected()
    );
    let error = found(MatrixQuantity::Stiffness).unwrap_err().to_string();
    assert!(
        error.contains("byte 48: ") && error.contains("NaN in `KAA`"),
        "{error}"
    );
}
