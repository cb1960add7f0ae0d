//! The objects that cover the most of a picture: what the device draws first, to find out what is hidden behind them.

use super::view::{Cells, View};
use crate::scene::Camera;
use crate::visible::frustum::Frustum;
use crate::visible::{Depth, World};

/// What is drawn: objects whose boxes cover this share of the picture or more, the largest first, until one of the sums is reached.
const LEAST_SHARE: f64 = 0.004;
const MOST_OBJECTS: usize = 512;
const MOST_TRIANGLES: usize = 65536;

/// The places in the world's list of what hides others the most, in the order of the list.
pub(in crate::visible) fn largest(
    world: &World,
    (camera, frustum, depth): (&Camera, &Frustum, &Depth),
    size: [u32; 2],
) -> Vec<usize> {
    let (view, list) = (View::of(camera, depth, size), &world.instances);
    let all = Cells { columns: (0, view.columns - 1), rows: (0, view.rows - 1) };
    let least = LEAST_SHARE * all.count() as f64;
    let covers = |place: usize| {
        let object = &world.objects[list.object(place)];
        // A mask's holes are known where it is shaded.
        if object.transparent || object.key.masked {
            return None;
        }
        let cells = match view.footprint(&object.bounds) {
            Some((cells, _)) => cells?.count(),
            None => all.count(),
        };
        (cells as f64 >= least).then_some((cells, place, object.triangles))
    };
    let may_cover = |bounds: &_| view.may_cover(bounds, least) && frustum.may_see(bounds);
    let mut found: Vec<_> = list.places_where(may_cover).filter_map(covers).collect();
    // Of equally large ones the first in the list.
    found.sort_unstable_by_key(|&(cells, place, _)| (std::cmp::Reverse(cells), place));
    let mut triangles = 0;
    let fits = |&(_, _, own): &(usize, usize, usize)| {
        let is_in = triangles + own <= MOST_TRIANGLES;
        triangles += if is_in { own } else { 0 };
        is_in
    };
    let mut places: Vec<usize> = found.into_iter().filter(fits).take(MOST_OBJECTS).map(|(_, place, _)| place).collect();
    places.sort_unstable();
    places
}
