//! Values in the mirrors that serde reads files into, which know their places in the text.
//!
//! [`super::check`] finds what is absent, out of range or contradictory. Here a value only has to
//! be of the right type.

use std::fmt;

use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};
use serde_spanned::Spanned;

/// Key that may be absent; its span is that of the value.
pub type Located<T> = Option<Spanned<T>>;

/// Finite number, written as a TOML float or integer.
#[derive(Debug, Clone, Copy)]
pub struct Number(pub f64);

/// Whole number, 0 or more.
#[derive(Debug, Clone, Copy)]
pub struct Count(pub usize);

/// Finite number, or a list of finite numbers.
#[derive(Debug, Clone)]
pub enum NumberOrList {
    One(f64),
    List(Vec<f64>),
}

/// List of exactly `N` finite numbers.
#[derive(Debug, Clone, Copy)]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberVisitor;
        impl Visitor<'_> for NumberVisitor {
            type Value = Number;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a finite number")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Number, E> {
                if v.is_finite() {
                    Ok(Number(v))
                } else {
                    Err(E::invalid_value(de::Unexpected::Float(v), &self))
                }
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Number, E> {
                Ok(Number(v as f64))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Number, E> {
                Ok(Number(v as f64))
            }
        }
        deserializer.deserialize_any(NumberVisitor)
    }
}

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct CountVisitor;
        impl Visitor<'_> for CountVisitor {
            type Value = Count;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a whole number, 0 or more")
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Count, E> {
                usize::try_from(v)
                    .map(Count)
                    .map_err(|_| E::invalid_value(de::Unexpected::Signed(v), &self))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Count, E> {
                usize::try_from(v)
                    .map(Count)
                    .map_err(|_| E::invalid_value(de::Unexpected::Unsigned(v), &self))
            }
        }
        deserializer.deserialize_any(CountVisitor)
    }
}

impl<'de> Deserialize<'de> for NumberOrList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrListVisitor;
        impl<'de> Visitor<'de> for NumberOrListVisitor {
            type Value = NumberOrList;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a finite number, or a list of finite numbers")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<NumberOrList, E> {
                if v.is_finite() {
                    Ok(NumberOrList::One(v))
                } else {
                    Err(E::invalid_value(de::Unexpected::Float(v), &self))
                }
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<NumberOrList, E> {
                Ok(NumberOrList::One(v as f64))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<NumberOrList, E> {
                Ok(NumberOrList::One(v as f64))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<NumberOrList, A::Error> {
                let mut numbers = Vec::new();
                while let Some(Number(number)) = seq.next_element()? {
                    numbers.push(number);
                }
                Ok(NumberOrList::List(numbers))
            }
        }
        deserializer.deserialize_any(NumberOrListVisitor)
    }
}

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumbersVisitor<const N: usize>;
        impl<'de, const N: usize> Visitor<'de> for NumbersVisitor<N> {
            type Value = Numbers<N>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a list of {N} finite numbers")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Numbers<N>, A::Error> {
                let mut values = [0.0; N];
                for (i, value) in values.iter_mut().enumerate() {
                    match seq.next_element::<Number>()? {
                        Some(Number(v)) => *value = v,
                        None => return Err(de::Error::invalid_length(i, &self)),
                    }
                }
                let mut extra = 0;
                while seq.next_element::<de::IgnoredAny>()?.is_some() {
                    extra += 1;
                }
                if extra > 0 {
                    return Err(de::Error::invalid_length(N + extra, &self));
                }
                Ok(Numbers(values))
            }
        }
        deserializer.deserialize_any(NumbersVisitor)
    }
}
