//! Ray records in memory, or in a file: fixed stride, little-endian columns of one float type.

use std::ops::Range;

use multiversion::multiversion;

use crate::ray_batch::RayBatch;
use crate::source::RaySource;
use crate::stored::StoredBytes;

/// The float type of a table's columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Float {
    /// IEEE-754 binary32, as ray files have it.
    F32,
    /// IEEE-754 binary64, as sets made in memory have it.
    F64,
}

impl Float {
    const fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// The type of a column on its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// IEEE-754 binary32 or binary64.
    Float(Float),
    /// A signed integer of 32 bits.
    Integer,
}

impl Number {
    const fn size(self) -> usize {
        match self {
            Self::Float(float) => float.size(),
            Self::Integer => 4,
        }
    }
}

/// A column on its own.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Offset in the record.
    pub offset: usize,
    /// Its type.
    pub number: Number,
    /// What one stored unit stands for.
    pub scale: f64,
}

impl Column {
    /// Its values, one for each record, behind those of a list.
    fn append(&self, records: &[u8], stride: usize, out: &mut Vec<f64>) {
        let each = records.chunks_exact(stride);
        match self.number {
            Number::Float(Float::F32) => out.extend(each.map(|r| read_f32(r, self.offset) * self.scale)),
            Number::Float(Float::F64) => out.extend(each.map(|r| read_f64(r, self.offset) * self.scale)),
            Number::Integer => out.extend(each.map(|r| read_i32(r, self.offset) * self.scale)),
        }
    }
}

/// Where the columns lie in a record \[bytes\], and what turns them into millimetres.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Bytes from one record to the next.
    pub stride: usize,
    /// Offset of x, y, z; None for far-field records, which have no position.
    pub position: Option<usize>,
    /// Offset of the direction's three components.
    pub direction: usize,
    /// Offset of the flux.
    pub flux: usize,
    /// Type of all these columns.
    pub float: Float,
    /// What tells the colour of a ray, if passes over the table are to know it.
    pub colour: Option<Column>,
    /// Millimetres per unit of position.
    pub length_scale: f64,
}

/// Where the records are.
#[derive(Clone, Copy, Debug)]
enum Store<'a> {
    Memory(&'a [u8]),
    File(&'a StoredBytes),
}

/// Records over borrowed bytes, or in a file.
///
/// Rays that a file does not give have no direction; [`StoredBytes::failure`] tells of them after a pass.
#[derive(Clone, Copy, Debug)]
pub struct RayTable<'a> {
    store: Store<'a>,
    len: u64,
    layout: Layout,
}

impl<'a> RayTable<'a> {
    /// A table over `bytes`; None if a column would reach past the record or the bytes are no whole number of records.
    #[must_use]
    pub fn new(bytes: &'a [u8], layout: Layout) -> Option<Self> {
        Self::over(Store::Memory(bytes), bytes.len() as u64, layout)
    }

    /// A table over a stretch of a file; None as with [`Self::new`].
    #[must_use]
    pub fn stored(bytes: &'a StoredBytes, layout: Layout) -> Option<Self> {
        Self::over(Store::File(bytes), bytes.len(), layout)
    }

    fn over(store: Store<'a>, bytes: u64, layout: Layout) -> Option<Self> {
        let width = layout.float.size();
        let fits = |offset: usize, columns: usize| {
            offset
                .checked_add(columns * width)
                .is_some_and(|end| end <= layout.stride)
        };
        let valid = layout.stride > 0
            && bytes.is_multiple_of(layout.stride as u64)
            && layout.position.is_none_or(|offset| fits(offset, 3))
            && fits(layout.direction, 3)
            && fits(layout.flux, 1)
            && layout.colour.is_none_or(|column| {
                let end = column.offset.checked_add(column.number.size());
                end.is_some_and(|end| end <= layout.stride)
            });
        valid.then(|| Self {
            store,
            len: bytes / layout.stride as u64,
            layout,
        })
    }

    /// Where the columns lie.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The bytes of some records, as they are stored; those of a file are read into `room`.
    ///
    /// # Panics
    /// If the table has fewer.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "indices lie inside a slice that is in memory, or will be"
    )]
    pub fn records<'s>(&self, range: Range<u64>, room: &'s mut Vec<u8>) -> &'s [u8]
    where
        'a: 's,
    {
        let stride = self.layout.stride;
        match self.store {
            Store::Memory(bytes) => &bytes[range.start as usize * stride..range.end as usize * stride],
            Store::File(file) => {
                assert!(range.end <= self.len, "records {range:?} of {}", self.len);
                room.resize((range.end - range.start) as usize * stride, 0);
                file.read(range.start * stride as u64, room);
                room
            }
        }
    }

    /// Puts rays of several ranges, together at most [`BLOCK`](crate::ray_batch::BLOCK), one after another into `batch`,
    /// settled.
    pub fn gather(&self, ranges: impl Iterator<Item = Range<u64>>, batch: &mut RayBatch) {
        batch.len = 0;
        batch.colour.clear();
        let mut room = std::mem::take(&mut batch.room);
        for range in ranges {
            let records = self.records(range, &mut room);
            if let Some(column) = &self.layout.colour {
                column.append(records, self.layout.stride, &mut batch.colour);
            }
            decode(records, &self.layout, batch);
        }
        batch.room = room;
        batch.settle();
    }
}

fn read_f32(record: &[u8], offset: usize) -> f64 {
    f64::from(f32::from_le_bytes([
        record[offset],
        record[offset + 1],
        record[offset + 2],
        record[offset + 3],
    ]))
}

fn read_f64(record: &[u8], offset: usize) -> f64 {
    let b = &record[offset..offset + 8];
    f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])
}

fn read_i32(record: &[u8], offset: usize) -> f64 {
    f64::from(i32::from_le_bytes([
        record[offset],
        record[offset + 1],
        record[offset + 2],
        record[offset + 3],
    ]))
}

/// Records that are read together, column by column: they stay in the processor's nearest memory.
const TOGETHER: usize = 128;

/// A column to be read: its offset, what one stored unit stands for, and where to.
type Wanted<'a> = (usize, f64, &'a mut [f64]);

/// The rays of some records come behind those of the batch.
fn decode(records: &[u8], layout: &Layout, batch: &mut RayBatch) {
    let count = records.len() / layout.stride;
    let range = batch.len..batch.len + count;
    batch.len = range.end;
    let width = layout.float.size();
    let [x, y, z] = batch.position.each_mut().map(|axis| &mut axis[range.clone()]);
    let [kx, ky, kz] = batch.direction.each_mut().map(|axis| &mut axis[range.clone()]);
    let (at, scale) = (layout.direction, layout.length_scale);
    let rest = [
        (at, 1.0, kx),
        (at + width, 1.0, ky),
        (at + 2 * width, 1.0, kz),
        (layout.flux, 1.0, &mut batch.flux[range]),
    ];
    if let Some(at) = layout.position {
        let position = [(at, scale, x), (at + width, scale, y), (at + 2 * width, scale, z)];
        read_columns(records, layout, position);
    } else {
        for axis in [x, y, z] {
            axis.fill(0.0);
        }
    }
    read_columns(records, layout, rest);
}

/// Reads columns: compiled for each instruction set, and for the strides that most tables have.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn read_columns<const N: usize>(records: &[u8], layout: &Layout, columns: [Wanted<'_>; N]) {
    let single = |bytes| f64::from(f32::from_le_bytes(bytes));
    match (layout.float, layout.stride) {
        (Float::F32, 28) => read_numbers(records, 28, columns, single),
        (Float::F32, 32) => read_numbers(records, 32, columns, single),
        (Float::F32, stride) => read_numbers(records, stride, columns, single),
        (Float::F64, 56) => read_numbers(records, 56, columns, f64::from_le_bytes),
        (Float::F64, stride) => read_numbers(records, stride, columns, f64::from_le_bytes),
    }
}

/// The loops of one stride: where it is known beforehand, several records are read at a time.
#[inline(always)]
fn read_numbers<const W: usize, const N: usize>(
    records: &[u8],
    stride: usize,
    mut columns: [Wanted<'_>; N],
    read: impl Fn([u8; W]) -> f64,
) {
    for (block, records) in records.chunks(TOGETHER * stride).enumerate() {
        for (offset, scale, out) in &mut columns {
            let out = &mut out[block * TOGETHER..];
            for (value, record) in out.iter_mut().zip(records.chunks_exact(stride)) {
                let mut bytes = [0; W];
                bytes.copy_from_slice(&record[*offset..*offset + W]);
                *value = read(bytes) * *scale;
            }
        }
    }
}

impl RaySource for RayTable<'_> {
    fn len(&self) -> u64 {
        self.len
    }

    fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
        self.gather(std::iter::once(range), batch);
    }
}

#[cfg(test)]
mod tests {
    use etendue_math::Vec3;

    use super::*;

    fn layout() -> Layout {
        Layout {
            stride: 30,
            position: Some(1),
            direction: 13,
            flux: 25,
            float: Float::F32,
            colour: None,
            length_scale: 25.4,
        }
    }

    #[test]
    fn reads_unaligned_records_in_any_column_order() {
        let mut bytes = Vec::new();
        for record in [
            [1.0, 2.0, 3.0, 0.0, 0.6, 0.8, 5.0_f32],
            [-1.0, 0.5, 0.25, 0.0, 3.0, 4.0, 7.0],
        ] {
            bytes.push(0xAA);
            bytes.extend(record.iter().flat_map(|v| v.to_le_bytes()));
            bytes.push(0xBB);
        }
        let table = RayTable::new(&bytes, layout()).expect("valid");
        let mut batch = RayBatch::default();
        assert_eq!(table.len(), 2);
        table.fill(0..2, &mut batch);
        assert!((batch.position(1).y - 12.7).abs() < 1e-12);
        assert!((batch.direction(1).z - 0.8).abs() < 1e-15 && (batch.norm_error - 4.0).abs() < 1e-15);
        assert_eq!(batch.flux[..2], [5.0, 7.0]);
    }

    #[test]
    fn records_of_any_stride_are_read_as_they_stand() {
        // More than are read together, in columns that lie apart.
        let count = 2 * TOGETHER as u64 + 37;
        for (float, stride) in [
            (Float::F32, 28),
            (Float::F32, 32),
            (Float::F32, 43),
            (Float::F64, 56),
            (Float::F64, 61),
        ] {
            let width = float.size();
            let number = |ray: u64, column: u64| (((ray * 7 + column) * 2_654_435_761) % 4096) as f64 / 64.0 + 1.0;
            let mut bytes = Vec::new();
            for ray in 0..count {
                let mut record: Vec<u8> = (0..7)
                    .flat_map(|column| {
                        let value = number(ray, column);
                        #[allow(clippy::cast_possible_truncation, reason = "a multiple of 1/64")]
                        match float {
                            Float::F32 => (value as f32).to_le_bytes().to_vec(),
                            Float::F64 => value.to_le_bytes().to_vec(),
                        }
                    })
                    .collect();
                record.resize(stride, 0xAB);
                bytes.extend(record);
            }
            // Flux, direction, position.
            let layout = Layout {
                stride,
                position: Some(4 * width),
                direction: width,
                flux: 0,
                float,
                colour: None,
                length_scale: 0.5,
            };
            let table = RayTable::new(&bytes, layout).expect("valid");
            let mut batch = RayBatch::default();
            table.gather([5..count, 0..5].into_iter(), &mut batch);
            for (i, ray) in (5..count).chain(0..5).enumerate() {
                let [w, kx, ky, kz, x, y, z] = std::array::from_fn(|column| number(ray, column as u64));
                let k = Vec3::new(kx, ky, kz);
                assert_eq!(batch.position(i), Vec3::new(x, y, z) * 0.5);
                assert!((batch.direction(i) - k * (1.0 / k.length())).length() < 1e-15);
                assert_eq!(batch.flux[i].to_bits(), w.to_bits());
            }
        }
    }

    #[test]
    fn colours_come_with_the_rays_if_they_are_asked_for() {
        let records: Vec<u8> = (0..5_i16)
            .flat_map(|i| {
                let floats: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.4 + 0.1 * f32::from(i)];
                let number = i32::from(i) - 2;
                floats
                    .into_iter()
                    .flat_map(f32::to_le_bytes)
                    .chain(number.to_le_bytes())
                    .collect::<Vec<u8>>()
            })
            .collect();
        let silent = Layout {
            stride: 36,
            position: Some(0),
            direction: 12,
            flux: 24,
            float: Float::F32,
            colour: None,
            length_scale: 1.0,
        };
        let column = |offset, number, scale| Layout {
            colour: Some(Column { offset, number, scale }),
            ..silent
        };
        let colours = |layout| {
            let mut batch = RayBatch::default();
            let table = RayTable::new(&records, layout).expect("valid");
            table.gather([3..5, 0..2].into_iter(), &mut batch);
            batch.colour
        };
        let micrometres = colours(column(28, Number::Float(Float::F32), 1e3));
        let expected = [700.0, 800.0, 400.0, 500.0];
        assert_eq!(micrometres.len(), 4);
        assert!(micrometres.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4));
        assert_eq!(colours(column(32, Number::Integer, 1.0)), [1.0, 2.0, -2.0, -1.0]);
        assert!(colours(silent).is_empty());
        assert!(RayTable::new(&records, column(33, Number::Integer, 1.0)).is_none());
        assert!(RayTable::new(&records, column(usize::MAX, Number::Integer, 1.0)).is_none());
    }

    #[test]
    fn refuses_columns_outside_the_record() {
        assert!(RayTable::new(&[0; 60], Layout { flux: 27, ..layout() }).is_none());
        assert!(
            RayTable::new(
                &[0; 60],
                Layout {
                    position: Some(usize::MAX - 3),
                    ..layout()
                }
            )
            .is_none()
        );
        assert!(RayTable::new(&[0; 61], layout()).is_none());
        assert!(RayTable::new(&[], Layout { stride: 0, ..layout() }).is_none());
    }

    #[test]
    fn counts_rays_that_cannot_be_used() {
        let rays = [
            [f32::NAN, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0],
            [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 1.0, 1.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0],
        ];
        let bytes: Vec<u8> = rays.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let layout = Layout {
            stride: 28,
            position: Some(0),
            direction: 12,
            flux: 24,
            float: Float::F32,
            colour: None,
            length_scale: 1.0,
        };
        let table = RayTable::new(&bytes, layout).expect("valid");
        let mut batch = RayBatch::default();
        table.fill(0..5, &mut batch);
        assert_eq!(batch.defects, [2, 1, 1]);
        assert_eq!(
            (0..5).map(|i| batch.usable(i)).collect::<Vec<_>>(),
            [false, false, false, false, true]
        );
    }
}
