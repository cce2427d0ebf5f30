//! Ray records in memory, or in a file: fixed stride, little-endian columns of one float type.

use std::ops::Range;

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
            match self.layout.float {
                Float::F32 => decode::<4, 12>(records, &self.layout, batch, |b| f64::from(f32::from_le_bytes(b))),
                Float::F64 => decode::<8, 24>(records, &self.layout, batch, f64::from_le_bytes),
            }
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

/// One pass over the records with the column reader known at compile time; they come behind those of the batch.
///
/// `W` is the width of a float, `W3` that of three.
#[inline(always)]
fn decode<const W: usize, const W3: usize>(
    records: &[u8],
    layout: &Layout,
    batch: &mut RayBatch,
    read: impl Fn([u8; W]) -> f64,
) {
    let one = |record: &[u8], offset: usize| -> f64 {
        let mut bytes = [0; W];
        bytes.copy_from_slice(&record[offset..offset + W]);
        read(bytes)
    };
    // One look at the bounds for three columns.
    let three = |record: &[u8], offset: usize| -> [f64; 3] {
        let columns = &record[offset..offset + W3];
        std::array::from_fn(|axis| one(columns, axis * W))
    };
    let (direction, flux, scale) = (layout.direction, layout.flux, layout.length_scale);
    let count = records.len() / layout.stride;
    let range = batch.len..batch.len + count;
    batch.len = range.end;
    let [px, py, pz] = batch.position.each_mut().map(|axis| &mut axis[range.clone()]);
    let [kx, ky, kz] = batch.direction.each_mut().map(|axis| &mut axis[range.clone()]);
    let w = &mut batch.flux[range];
    let each = || records.chunks_exact(layout.stride);
    if let Some(position) = layout.position {
        for (((x, y), z), record) in px.iter_mut().zip(py).zip(pz).zip(each()) {
            let found = three(record, position);
            (*x, *y, *z) = (found[0] * scale, found[1] * scale, found[2] * scale);
        }
    } else {
        for axis in [px, py, pz] {
            axis.fill(0.0);
        }
    }
    for ((((x, y), z), w), record) in kx.iter_mut().zip(ky).zip(kz).zip(w).zip(each()) {
        [*x, *y, *z] = three(record, direction);
        *w = one(record, flux);
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
