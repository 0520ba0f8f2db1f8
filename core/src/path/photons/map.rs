//! Photons by place.

use crate::path::photons::photon::Photon;
use glam::{IVec3, Vec3};

/// Photons by the cell of a grid that they are in. Cells are two radii wide, so that a ball touches at most eight.
#[derive(Debug)]
pub struct PhotonMap<T> {
    photons: Vec<Photon<T>>,
    /// Where photons are, and their numbers, bucket after bucket: what is too far away is not looked at.
    places: Vec<(Vec3, u32)>,
    /// Where each bucket of cells begins; one more at the end.
    starts: Vec<u32>,
    radius: f32,
}

impl<T> PhotonMap<T> {
    /// For balls of `radius`. Photons of a bucket keep their order.
    pub fn new(photons: Vec<Photon<T>>, radius: f32) -> Self {
        let buckets = photons.len().next_power_of_two();
        let bucket_of = |photon: &Photon<T>| bucket(cell(photon.position, radius), buckets);
        let mut starts = vec![0_u32; buckets + 1];
        for photon in &photons {
            starts[bucket_of(photon) + 1] += 1;
        }
        for i in 0..buckets {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut places = vec![(Vec3::ZERO, 0); photons.len()];
        for (number, photon) in (0..).zip(&photons) {
            let place = &mut next[bucket_of(photon)];
            places[*place as usize] = (photon.position, number);
            *place += 1;
        }
        Self { photons, places, starts, radius }
    }

    /// Calls `visit` with each photon within the radius of a point, and its squared distance.
    pub fn around(&self, point: Vec3, mut visit: impl FnMut(&Photon<T>, f32)) {
        let buckets = self.starts.len() - 1;
        let lowest = cell(point - Vec3::splat(self.radius), self.radius);
        let mut seen = [usize::MAX; 8];
        for corner in 0..8 {
            let offset = IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let bucket = bucket(lowest + offset, buckets);
            if seen.contains(&bucket) {
                continue;
            }
            seen[corner as usize] = bucket;
            for (position, number) in
                &self.places[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
            {
                let squared = (position - point).length_squared();
                if squared < self.radius * self.radius {
                    visit(&self.photons[*number as usize], squared);
                }
            }
        }
    }

    /// Radius of balls.
    pub fn radius(&self) -> f32 {
        self.radius
    }
}

fn cell(position: Vec3, radius: f32) -> IVec3 {
    (position / (2.0 * radius)).floor().as_ivec3()
}

/// Cells far apart may share a bucket.
fn bucket(cell: IVec3, buckets: usize) -> usize {
    let mixed = (cell.x as u32).wrapping_mul(0x9e37_79b1)
        ^ (cell.y as u32).wrapping_mul(0x85eb_ca77)
        ^ (cell.z as u32).wrapping_mul(0xc2b2_ae3d);
    let spread = mixed ^ (mixed >> 15);
    (spread.wrapping_mul(0x2c1b_3c6d) >> 3) as usize & (buckets - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::warp;
    use crate::sampler::{Dimension, Sampler};

    #[test]
    fn a_ball_holds_what_a_search_through_all_finds() {
        let at = |i| warp::sphere(Sampler::new(1, 0, [0, 0], i).pair(Dimension::Film)) * 3.0;
        let photon = |i| Photon { position: at(i), from: Vec3::X, ng: Vec3::X, carried: i, scatterings: 0 };
        let map = PhotonMap::new((0..5000).map(photon).collect(), 0.4);
        for i in 0..50 {
            let point = at(10_000 + i) * 1.01;
            let mut found = Vec::new();
            map.around(point, |photon, _| found.push(photon.carried));
            found.sort_unstable();
            let all: Vec<u32> = (0..5000).filter(|j| (at(*j) - point).length_squared() < 0.4 * 0.4).collect();
            assert!(!all.is_empty());
            assert_eq!(found, all);
        }
    }
}
