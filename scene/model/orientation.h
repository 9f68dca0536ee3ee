// How a photo is held to look at it. Pixels stay as they are stored, and cameras are those of the stored pixels; EXIF's
// orientation (1 to 8) says which side of them is up. It counts where a person looks (report, viewer, fly-through) and
// where gravity matters (a scene's up axis). Mirrored orientations (2, 4, 5, 7) are turned, never mirrored: a mirrored
// picture has no camera.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"
#include "scene/model/image.h"

namespace lumi {

constexpr bool IsOrientation(int orientation) { return orientation >= 1 && orientation <= 8; }

// Quarter turns clockwise, 0 to 3, after which the stored picture is upright. Whatever is no orientation counts as 1.
int QuarterTurns(int orientation);

// Upright, width and height change places.
inline bool SwapsSides(int orientation) { return QuarterTurns(orientation) % 2 == 1; }
inline Eigen::Vector2i UprightSize(const Eigen::Vector2i& stored, int orientation) {
  return SwapsSides(orientation) ? Eigen::Vector2i(stored.y(), stored.x()) : stored;
}

// The photo's own up in its camera's frame (x right, y down): a unit vector in the image plane.
Eigen::Vector3d UpInCamera(int orientation);

// The camera that would have stored the picture upright: same centre, same rays. `stored` must be a pinhole.
std::pair<Camera, Rigid3> UprightCamera(const Camera& stored, const Rigid3& cam_from_world, int orientation);

// The pose alone, and its inverse: of a camera held so that its pictures are stored with this orientation.
Rigid3 UprightPose(const Rigid3& cam_from_world, int orientation);
Rigid3 StoredPose(const Rigid3& upright_from_world, int orientation);

// The picture itself.
Image8 UprightPicture(const Image8& stored, int orientation);
// The stored picture of an upright one: what UprightPicture undoes.
Image8 StoredPicture(const Image8& upright, int orientation);

}  // namespace lumi
