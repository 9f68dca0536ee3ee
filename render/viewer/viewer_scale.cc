// Marks in the picture, and the scale that follows from what the user knows to lie between two of them.
#include <fmt/format.h>

#include <cmath>

#include "render/viewer/viewer_app.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/projection.h"
#include "scene/program/error.h"

namespace lumi {

void Viewer::Mark(const Eigen::Vector2d& x_px) {
  const auto point = PointAt(x_px.x(), x_px.y());
  if (!point) return Say("nothing of the proxy is here");
  if (facts_.marks.size() == 2) facts_.marks.clear();
  facts_.marks.push_back(*point);
  if (facts_.marks.size() == 1) return Say("a mark; M over another point measures");
  Say(LengthText((facts_.marks[0] - facts_.marks[1]).norm(), facts_.metres_per_unit) + " between the marks");
}

void Viewer::SetScale(double metres) {
  if (facts_.marks.size() < 2) throw UsageError("two marks are needed for a scale", "M over each of two points");
  const double units = (facts_.marks[0] - facts_.marks[1]).norm();
  if (!(metres > 0) || !std::isfinite(metres / units))
    throw UsageError(fmt::format("{:g} m between marks {:g} units apart is no scale", metres, units));
  WriteScale(scene_.folder, metres / units);
  facts_.metres_per_unit = metres / units;
  Say(fmt::format("a unit of the scene is {:.6g} m", *facts_.metres_per_unit));
}

void Viewer::DrawMarks() const {
  const Matrix34d P = MakeWindowView(steering_.navigator.state(), size_px_.x(), size_px_.y()).P;
  std::vector<Eigen::Vector2d> shown;
  for (const Eigen::Vector3d& mark : facts_.marks)
    if (const auto x = Project(P, mark)) {
      DrawPivot(x->x(), x->y(), 1.0);
      shown.push_back(*x);
    }
  if (shown.size() == 2) DrawLine(shown[0], shown[1]);
}

}  // namespace lumi
