//! Nodes of a far field, and sums of rays over them.

use std::sync::Arc;

use etendue_math::Vec3;
use etendue_trace::detector::FarFieldNodes;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Nodes of a far field: rows of γ, and the nodes C of each row \[rad\].
#[pyclass(frozen, module = "etendue._core")]
pub struct FarField {
    nodes: Arc<FarFieldNodes>,
}

impl FarField {
    /// The core's nodes.
    pub fn nodes(&self) -> Arc<FarFieldNodes> {
        Arc::clone(&self.nodes)
    }
}

#[pymethods]
impl FarField {
    #[new]
    fn new(gamma: Vec<f64>, c: Vec<Vec<f64>>) -> PyResult<Self> {
        let nodes =
            FarFieldNodes::new(gamma, c).ok_or_else(|| PyValueError::new_err("these are no nodes of a far field"))?;
        Ok(Self { nodes: Arc::new(nodes) })
    }

    /// Number of nodes, and the cell of all rays together.
    fn __len__(&self) -> usize {
        self.nodes.cells()
    }

    /// Adds rays to Σ w, Σ w² and the number of rays of each cell, one ray after the other.
    #[allow(clippy::needless_pass_by_value, reason = "arrays of Python")]
    fn add(
        &self,
        py: Python<'_>,
        direction: PyReadonlyArray2<'_, f64>,
        flux: PyReadonlyArray1<'_, f64>,
        mut sums: PyReadwriteArray1<'_, f64>,
        mut squares: PyReadwriteArray1<'_, f64>,
        mut rays: PyReadwriteArray1<'_, u64>,
    ) -> PyResult<()> {
        let cells = self.nodes.cells();
        if direction.shape() != [flux.len(), 3] || [sums.len(), squares.len(), rays.len()] != [cells; 3] {
            return Err(PyValueError::new_err(
                "directions (n, 3), fluxes (n,), and three arrays of all cells",
            ));
        }
        let (direction, flux) = (direction.as_slice()?, flux.as_slice()?);
        let (sums, squares, rays) = (sums.as_slice_mut()?, squares.as_slice_mut()?, rays.as_slice_mut()?);
        py.detach(|| {
            for (d, w) in direction.chunks_exact(3).zip(flux) {
                self.nodes.share(Vec3::new(d[0], d[1], d[2]), |cell, share| {
                    let (cell, w) = (cell as usize, share * w);
                    sums[cell] += w;
                    squares[cell] += w * w;
                    rays[cell] += 1;
                });
            }
        });
        Ok(())
    }
}
