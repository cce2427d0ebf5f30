//! Sources of rays as Python objects.

use std::ops::Range;

use etendue_geometry::ray_batch::BLOCK;
use etendue_geometry::table::{Column, Float, Layout, Number, RayTable as CoreTable};
use etendue_geometry::{RayBatch, RaySource};
use etendue_lightfield::field::draw::FieldRays as CoreFieldRays;
use etendue_optics::source::{Ring, RingSource as CoreRings};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::field::FieldRays;
use crate::scene::lines;
use crate::stored::StoredBytes;

/// Where the records of a table are.
#[derive(FromPyObject)]
pub enum Records {
    /// In memory.
    Array(Py<PyArray1<u8>>),
    /// In a file.
    File(Py<StoredBytes>),
}

/// Ray records over the bytes of an array, or of a file.
#[pyclass(frozen, module = "etendue._core")]
pub struct RayTable {
    pub records: Records,
    pub layout: Layout,
}

#[pymethods]
impl RayTable {
    #[new]
    #[pyo3(signature = (records, stride, position, direction, flux, double, length_scale, colour=None))]
    #[allow(clippy::too_many_arguments, reason = "Python hands them over by name")]
    fn new(
        py: Python<'_>,
        records: Records,
        stride: usize,
        position: Option<usize>,
        direction: usize,
        flux: usize,
        double: bool,
        length_scale: f64,
        colour: Option<(usize, &str, f64)>,
    ) -> PyResult<Self> {
        let column = |(offset, number, scale): (usize, &str, f64)| {
            let number = match number {
                "<f4" => Number::Float(Float::F32),
                "<f8" => Number::Float(Float::F64),
                "<i4" => Number::Integer,
                other => return Err(PyValueError::new_err(format!("a column of {other}"))),
            };
            Ok(Column { offset, number, scale })
        };
        let float = if double { Float::F64 } else { Float::F32 };
        let layout = Layout {
            stride,
            position,
            direction,
            flux,
            float,
            colour: colour.map(column).transpose()?,
            length_scale,
        };
        let table = Self { records, layout };
        Opened::table(py, &table)?.core()?;
        Ok(table)
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(usize::try_from(Opened::table(py, self)?.core()?.len())?)
    }
}

/// The three-ring source, or any other set of concentric Lambertian rings.
#[pyclass(frozen, module = "etendue._core")]
pub struct RingSource(CoreRings);

#[pymethods]
impl RingSource {
    #[new]
    fn new(rings: Vec<(f64, f64, f64, u64)>, runs: u64, seed: u64) -> PyResult<Self> {
        let rings = rings
            .into_iter()
            .map(|(inner, outer, flux, rays)| Ring {
                inner,
                outer,
                flux,
                rays,
            })
            .collect();
        CoreRings::new(rings, runs, seed)
            .map(Self)
            .ok_or_else(|| PyValueError::new_err("a ring source needs at least one ray, and fewer than 2^64"))
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(usize::try_from(self.0.len())?)
    }
}

/// Any source, borrowed for the time of a call.
pub enum Source<'a> {
    Table(CoreTable<'a>),
    Rings(&'a CoreRings),
    Field(CoreFieldRays<'a>),
}

impl RaySource for Source<'_> {
    fn len(&self) -> u64 {
        match self {
            Self::Table(table) => table.len(),
            Self::Rings(rings) => rings.len(),
            Self::Field(rays) => rays.len(),
        }
    }

    fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
        match self {
            Self::Table(table) => table.fill(range, batch),
            Self::Rings(rings) => rings.fill(range, batch),
            Self::Field(rays) => rays.fill(range, batch),
        }
    }
}

/// A Python source, held open for the time of a call.
pub enum Opened<'py> {
    Table(PyReadonlyArray1<'py, u8>, Layout),
    File(Bound<'py, StoredBytes>, Layout),
    Rings(Bound<'py, RingSource>),
    Field(Bound<'py, FieldRays>),
}

impl<'py> Opened<'py> {
    /// The source behind a Python object.
    pub fn new(source: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(table) = source.cast::<RayTable>() {
            Self::table(source.py(), table.get())
        } else if let Ok(rays) = source.cast::<FieldRays>() {
            Ok(Self::Field(rays.clone()))
        } else {
            Ok(Self::Rings(source.cast::<RingSource>()?.clone()))
        }
    }

    /// The records of a table.
    pub fn table(py: Python<'py>, table: &RayTable) -> PyResult<Self> {
        Ok(match &table.records {
            Records::Array(bytes) => Self::Table(bytes.bind(py).try_readonly()?, table.layout),
            Records::File(bytes) => Self::File(bytes.bind(py).clone(), table.layout),
        })
    }

    /// The core's view of it.
    pub fn core(&self) -> PyResult<Source<'_>> {
        let no_table =
            |bytes: u64, layout: &Layout| PyValueError::new_err(format!("{bytes} bytes are not a table of {layout:?}"));
        Ok(match self {
            Self::Table(bytes, layout) => {
                let bytes = bytes.as_slice()?;
                let table = CoreTable::new(bytes, *layout);
                Source::Table(table.ok_or_else(|| no_table(bytes.len() as u64, layout))?)
            }
            Self::File(bytes, layout) => {
                let bytes = bytes.get().core();
                let table = CoreTable::stored(bytes, *layout);
                Source::Table(table.ok_or_else(|| no_table(bytes.len(), layout))?)
            }
            Self::Rings(rings) => Source::Rings(&rings.get().0),
            Self::Field(rays) => Source::Field(rays.get().core()),
        })
    }

    /// What is to be said of the source after a pass: whether its file gave all that it was asked for.
    pub fn check(&self) -> PyResult<()> {
        match self {
            Self::File(bytes, _) => bytes.get().check(bytes.py()),
            Self::Table(..) | Self::Rings(_) | Self::Field(_) => Ok(()),
        }
    }
}

/// Calls `body` with the core's view of a Python source; what it found counts only if the source gave all its rays.
pub fn with_source<R>(source: &Bound<'_, PyAny>, body: impl FnOnce(&Source<'_>) -> PyResult<R>) -> PyResult<R> {
    let opened = Opened::new(source)?;
    let found = body(&opened.core()?);
    opened.check()?;
    found
}

/// What the records of rays `start..stop` state of their colours, as they were opened; empty if nothing.
#[pyfunction]
pub fn read_colours<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    start: u64,
    stop: u64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    with_source(source, |source| {
        let mut colours = Vec::new();
        let range = start..stop.min(source.len());
        py.detach(|| source.for_each_block(range, |_, batch| colours.extend_from_slice(&batch.colour)));
        Ok(PyArray1::from_vec(py, colours))
    })
}

/// The wavelengths of rays `start..stop` of a stream that have nothing but a spectrum in common \[nm\].
#[pyfunction]
pub fn draw_wavelengths(
    py: Python<'_>,
    wavelengths: Vec<f64>,
    shares: Vec<f64>,
    seed: u64,
    start: u64,
    stop: u64,
) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let lines = lines(wavelengths, &shares)?;
    let drawn = py.detach(|| etendue_optics::source::draw_wavelengths(&lines, seed, start..stop));
    Ok(PyArray1::from_vec(py, drawn))
}

type RayArrays<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
);

/// Rays `start..stop` as (position (n, 3) \[mm\], unit direction (n, 3), flux (n,)).
#[pyfunction]
pub fn read_rays<'py>(py: Python<'py>, source: &Bound<'py, PyAny>, start: u64, stop: u64) -> PyResult<RayArrays<'py>> {
    read_pieces(py, source, vec![(start, stop)])
}

/// The rays of some ranges (start, stop), one after another, as (position (n, 3) \[mm\], unit direction (n, 3), flux (n,)).
#[pyfunction]
pub fn read_pieces<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    ranges: Vec<(u64, u64)>,
) -> PyResult<RayArrays<'py>> {
    with_source(source, |source| {
        let mut n = 0;
        for (start, stop) in &ranges {
            if start > stop || *stop > source.len() {
                return Err(PyValueError::new_err(format!(
                    "rays {start}..{stop} of {}",
                    source.len()
                )));
            }
            n += usize::try_from(stop - start)?;
        }
        let (mut position, mut direction, mut flux) = (vec![0.0; 3 * n], vec![0.0; 3 * n], vec![0.0; n]);
        py.detach(|| {
            let (mut at, mut batch) = (0, RayBatch::default());
            let blocks = ranges.into_iter().flat_map(|(start, stop)| {
                let first = (start..stop).step_by(BLOCK);
                first.map(move |first| first..(first + BLOCK as u64).min(stop))
            });
            for block in blocks {
                source.fill(block, &mut batch);
                for i in 0..batch.len {
                    for axis in 0..3 {
                        position[3 * (at + i) + axis] = batch.position[axis][i];
                        direction[3 * (at + i) + axis] = batch.direction[axis][i];
                    }
                }
                flux[at..at + batch.len].copy_from_slice(&batch.flux[..batch.len]);
                at += batch.len;
            }
        });
        Ok((
            PyArray1::from_vec(py, position).reshape([n, 3])?,
            PyArray1::from_vec(py, direction).reshape([n, 3])?,
            PyArray1::from_vec(py, flux),
        ))
    })
}
