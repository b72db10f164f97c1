//! Neighbors in a row-major grid of cells.

/// Iterates over the neighbors of cell `k` of a grid of `n_x` by `n_z` cells: at most four.
pub(crate) fn neighbors(k: usize, n_x: usize, n_z: usize) -> impl Iterator<Item = usize> {
    let (x, z) = (k % n_x, k / n_x);
    let beside = [
        (x > 0).then(|| k - 1),
        (x + 1 < n_x).then(|| k + 1),
        (z > 0).then(|| k - n_x),
        (z + 1 < n_z).then(|| k + n_x),
    ];
    beside.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_have_two_neighbors_and_the_middle_four() {
        let neighbors_of = |k| neighbors(k, 3, 3).collect::<Vec<_>>();
        assert_eq!(
            [neighbors_of(0), neighbors_of(4), neighbors_of(8)],
            [vec![1, 3], vec![3, 5, 1, 7], vec![7, 5]]
        );
    }
}
