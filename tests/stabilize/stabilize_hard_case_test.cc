// Where a video has no structure, too little of it, or something else in it: each ends in the right path or a named
// refusal.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/geometry/angle.h"
#include "scene/geometry/dense_solvers.h"
#include "stabilize/jitter.h"
#include "tests/stabilize/stabilized_walks.h"

namespace lumi {
namespace {

using namespace test;

constexpr double kFamilyPx = 0.1;  // of paths that are smooth by their form
constexpr double kTripodPx = 1.0;

TEST(HardCase, PureRotationIsSmoothedByHomographiesAndSaysSo) {
  const Walk walk = Turning(120, [](double u) { return Pan(0.7 * (u - 0.5)); }, {});
  StabilizeReport report;
  EXPECT_LT(JitterPx(walk, Stabilized(walk, With(MotionModel::kSmooth), {}, &report)), kJitterPx);
  EXPECT_TRUE(report.homographies);
  EXPECT_GT(report.shake_before_px, 5);
  EXPECT_LT(report.shake_after_px, kJitterPx);
  // Every path of one centre keeps it: what comes out are homographies too.
  const auto P = Stabilized(walk, With(MotionModel::kLinear));
  for (const Matrix34d& p : P) EXPECT_LT(p.col(3).norm(), 1e-9 * p.norm());
  EXPECT_EQ(Refused([&] { Stabilized(walk, With(MotionModel::kCircular)); }).find("circular: "), 0U);
  StabilizeOptions vertigo = With(MotionModel::kVertigo);
  vertigo.object_px = {200, 100, 200, 200};
  EXPECT_EQ(Refused([&] { Stabilized(walk, vertigo); }).find("vertigo: "), 0U);
}

TEST(HardCase, ATripodsVideoStaysWhatItIs) {
  const Walk walk = Turning(
      60, [](double) { return Eigen::Matrix3d::Identity(); }, kStill);
  for (const MotionModel model : {MotionModel::kSmooth, MotionModel::kLinear}) {
    StabilizeOptions options = With(model);
    options.crop = true;  // there is nothing to crop
    StabilizeReport report;
    EXPECT_LT(LargestDistancePx(walk, Stabilized(walk, options, {}, &report), walk.shaky), kTripodPx);
    EXPECT_GE(report.view_scale, 0.998);
  }
  // The tracker's noise and a touch of the tripod, in a scene with structure too.
  const Walk nearly = Sideways(60, kStill);
  Walk still = nearly;
  for (std::size_t t = 0; t < 60; ++t) {
    still.shaky[t] = still.ideal[t] = nearly.ideal[0];
    still.seen[t] = nearly.seen[0];
  }
  Telling telling;
  telling.noise_px = 0.2;
  for (const MotionModel model : {MotionModel::kSmooth, MotionModel::kLinear})
    EXPECT_LT(LargestDistancePx(still, Stabilized(still, With(model), telling), still.shaky), kTripodPx);
  EXPECT_EQ(Refused([&] { Stabilized(still, With(MotionModel::kCircular)); }).find("circular: "), 0U);
}

TEST(HardCase, APlaneFilmedAlongALineIsExactByItsHomographies) {
  // G + s e n^T: the wall at z = 1 + 0.1 x, the camera along it and towards it.
  for (const Hand& hand : {kStill, Hand{}}) {
    const Walk walk = Turning(
        90,
        [](double u) {
          Eigen::Matrix3d K;
          K << kFocalPx, 0, 320, 0, kFocalPx, 180, 0, 0, 1;
          return Eigen::Matrix3d(
              K *
              (Eigen::Matrix3d::Identity() + u * Eigen::Vector3d(0.5, 0.05, -0.2) * Eigen::RowVector3d(-0.1, 0, 1)) *
              K.inverse());
        },
        hand);
    const auto P = Stabilized(walk, With(MotionModel::kLinear));
    if (hand.turn_rad == 0) {
      EXPECT_LT(LargestDistancePx(walk, P, walk.ideal), 1e-3);
    }
    EXPECT_LT(JitterPx(walk, P), kFamilyPx);
    EXPECT_LT(JitterPx(walk, Stabilized(walk, With(MotionModel::kSmooth))), kJitterPx);
  }
}

TEST(HardCase, AZoomWithoutMotionIsSmoothedWithoutItsShake) {
  const Walk walk = Turning(120, [](double u) { return Zoom(1 + u); }, {0.008, 0, 0.01, 0, 4});
  StabilizeReport report;
  EXPECT_LT(JitterPx(walk, Stabilized(walk, With(MotionModel::kSmooth), {}, &report)), kJitterPx);
  EXPECT_TRUE(report.homographies);
}

TEST(HardCase, TheFocusOfExpansionMayLieAnywhereAndGoThroughTheBorder) {
  // Along (sin a, 0, cos a), looking ahead: the focus is at the picture's middle, inside, on its border, just beyond,
  // far, at infinity.
  const double border_deg = std::atan(320 / kFocalPx) * kDegPerRad;
  for (const double angle_deg : {0.0, 15.0, border_deg, border_deg + 1e-9, 50.0, 85.0, 89.999, 90.0, 90.001, 120.0}) {
    const Eigen::Vector3d along(std::sin(angle_deg * kRadPerDeg), 0, std::cos(angle_deg * kRadPerDeg));
    const Walk walk = Film(
        40,
        [&](double u) {
          return Pose{{Eigen::Quaterniond::Identity(), -2 * u * along}};
        },
        PointsIn({-9, -4, 5}, {9, 4, 20}, 500, 31), kStill);
    StabilizeReport report;
    EXPECT_LT(LargestDistancePx(walk, Stabilized(walk, With(MotionModel::kLinear), {}, &report), walk.ideal), 1e-3)
        << angle_deg;
    ASSERT_TRUE(report.focus_of_expansion_px);
    const Eigen::Vector3d e = *report.focus_of_expansion_px,
                          truth(kFocalPx * along.x() + 320 * along.z(), 180 * along.z(), along.z());
    EXPECT_LT(e.normalized().cross(truth.normalized()).norm(), 1e-5) << angle_deg;
  }
  // And within one video: a walk that turns from its line of sight, the focus passing through the border.
  const Walk turning = Film(120,
                            [](double u) {
                              const double a = 1.2 * u;
                              return Pose{LookAt({0, 0, 4 * u}, Eigen::Vector3d(std::sin(a), 0, 4 * u + std::cos(a)),
                                                 -Eigen::Vector3d::UnitY())};
                            },
                            PointsIn({-12, -4, -2}, {25, 4, 25}, 2000, 32), {});
  EXPECT_LT(JitterPx(turning, Stabilized(turning, With(MotionModel::kSmooth))), kJitterPx);
}

// What a reconstruction makes of a point's sights: where they, and the matrices, put it (linear), and the error that is
// left.
void PutWhereItWasSeen(const Scene& scene, Point& point) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(4, 4);
  for (const Observation& o : point.track) {
    const Matrix34d& P = scene.views[static_cast<std::size_t>(o.view.value)].P;
    for (int r = 0; r < 2; ++r) {
      const Eigen::Vector4d row = (P.row(r) - o.x_px[r] * P.row(2)).transpose() / P.norm();
      A += row * row.transpose();
    }
  }
  point.X_in_world = LeastDirection(A);
  const Matrix34d& first = scene.views[static_cast<std::size_t>(point.track.front().view.value)].P;
  if (first.row(2).dot(point.X_in_world) < 0) point.X_in_world = -point.X_in_world;
  point.error_px = 0;
  for (const Observation& o : point.track)
    point.error_px +=
        ((scene.views[static_cast<std::size_t>(o.view.value)].P * point.X_in_world).hnormalized() - o.x_px).norm() /
        static_cast<double>(point.track.size());
}
// And of a frame's: the matrix that its sights, and the points, ask for (linear).
void FilmFromItsSights(Scene& scene) {
  std::vector<Eigen::MatrixXd> A(scene.views.size(), Eigen::MatrixXd::Zero(12, 12));
  const Eigen::Vector2d middle(0.5 * kWidthPx, 0.5 * kHeightPx);
  for (const Point& point : scene.points)
    for (const Observation& o : point.track) {
      const Eigen::Vector2d x = (o.x_px - middle) / middle.x();
      const Eigen::Vector4d X = point.X_in_world.normalized();
      for (int r = 0; r < 2; ++r) {
        Eigen::Matrix<double, 12, 1> row = Eigen::Matrix<double, 12, 1>::Zero();
        row.segment<4>(4 * r) = X, row.segment<4>(8) = -x[r] * X;
        A[static_cast<std::size_t>(o.view.value)] += row * row.transpose();
      }
    }
  Eigen::Matrix3d pixels;
  pixels << middle.x(), 0, middle.x(), 0, middle.x(), middle.y(), 0, 0, 1;
  for (std::size_t t = 0; t < scene.views.size(); ++t) {
    const Eigen::VectorXd p = LeastDirection(A[t]);
    Matrix34d P;
    P << p.segment<4>(0).transpose(), p.segment<4>(4).transpose(), p.segment<4>(8).transpose();
    P = pixels * P;
    if (P.row(2).dot(scene.views[t].P.row(2)) < 0) P = -P;
    scene.views[t].P = P / P.norm();
  }
}

// The path is fitted to where matrices put points: what moves by itself, or row by row, has to reach those.
TEST(HardCase, FortyPercentOfThePointsMoveByThemselves) {
  const Walk walk = Sideways(90);
  Scene scene = Told(walk);
  // Along the camera's way, at -2.4 to 0.7 times its pace of 0.8 m/s: a track like any other, of a point at a quarter
  // to three times the depth.
  int believed = 0;
  for (std::size_t j = 0; j < scene.points.size(); ++j) {
    if (j % 5 >= 2) continue;
    const double pace = 0.8 * (-2.4 + 3.1 * static_cast<double>(j) / static_cast<double>(scene.points.size()));
    Point& point = scene.points[j];
    const Eigen::Vector4d truth = point.X_in_world / point.X_in_world.w();
    for (Observation& o : point.track) {
      const auto t = static_cast<std::size_t>(o.view.value);
      const Eigen::Vector4d X = truth + Eigen::Vector4d(pace * (static_cast<double>(t) - 45) / kFps, 0, 0, 0);
      o.x_px = Eigen::Vector3d(walk.shaky[t] * X).hnormalized();
    }
    PutWhereItWasSeen(scene, point);
    const double depth = point.X_in_world.z() / point.X_in_world.w() / truth.z();
    if (depth > 0.9 && depth < 1.1) continue;
    believed += point.error_px < 4;  // ReadFilmedScene's bound
  }
  EXPECT_GT(believed, static_cast<int>(scene.points.size()) / 3);
  for (const MotionModel model : {MotionModel::kLinear, MotionModel::kSmooth}) {
    StabilizeReport report;
    const auto P = InWalk(Stabilize(ReadFilmedScene(scene, std::nullopt), With(model), report, SilentProgress()), {});
    EXPECT_LT(JitterPx(walk, P), model == MotionModel::kLinear ? kFamilyPx : kJitterPx);
  }
}

TEST(HardCase, AFewFramesAreEnoughOrRefused) {
  const Walk ten = Sideways(10);
  for (const MotionModel model : {MotionModel::kLinear, MotionModel::kSmooth}) {
    const auto P = Stabilized(ten, With(model));
    EXPECT_EQ(P.size(), 10U);
    EXPECT_LT(LargestDistancePx(ten, P, ten.ideal), 60);  // a third of a second says little of what was meant
  }
  EXPECT_LT(LargestDistancePx(Sideways(10, kStill), Stabilized(Sideways(10, kStill), With(MotionModel::kSmooth)),
                              Sideways(10, kStill).ideal),
            1e-2);
  const Walk three = Sideways(3, kStill), two = Sideways(2, kStill);
  EXPECT_LT(LargestDistancePx(three, Stabilized(three, With(MotionModel::kLinear)), three.ideal), 1e-2);
  EXPECT_LT(LargestDistancePx(three, Stabilized(three, With(MotionModel::kSmooth)), three.ideal), 1e-2);
  EXPECT_LT(LargestDistancePx(two, Stabilized(two, With(MotionModel::kSmooth)), two.ideal), 1e-6);
  EXPECT_NE(Refused([&] { Stabilized(two, With(MotionModel::kLinear)); }).find("three frames"), std::string::npos);
  EXPECT_NE(Refused([&] { Stabilized(Sideways(1), With(MotionModel::kSmooth)); }).find("1 view"), std::string::npos);
  EXPECT_EQ(Refused([&] { Stabilized(three, With(MotionModel::kCircular)); }).find("circular: "), 0U);
}

TEST(HardCase, WithoutAPointSmoothChangesNothingAndModelsAreRefused) {
  Walk walk = Sideways(30);
  Scene scene = Told(walk);
  scene.points.clear();
  StabilizeReport report;
  const FilmedScene film = ReadFilmedScene(scene, std::nullopt);
  const auto P = InWalk(Stabilize(film, With(MotionModel::kSmooth), report, SilentProgress()), {});
  EXPECT_LT(LargestDistancePx(walk, P, walk.shaky), 1e-6);
  EXPECT_EQ(report.view_scale, 1);
  EXPECT_NE(Refused([&] {
              Stabilize(film, With(MotionModel::kLinear), report, SilentProgress());
            }).find("no frame has a point"),
            std::string::npos);
  EXPECT_FALSE(Refused([&] { Stabilize(film, With(MotionModel::kCircular), report, SilentProgress()); }).empty());
}

TEST(HardCase, FramesWithoutPointsInsideAVideoAreCarriedByTheirNeighbours) {
  const Walk walk = Wander(120);
  Scene scene = Told(walk);
  for (Point& point : scene.points)
    std::erase_if(point.track, [](const Observation& o) { return o.view.value >= 50 && o.view.value < 65; });
  for (const MotionModel model : {MotionModel::kSmooth, MotionModel::kLinear}) {
    StabilizeReport report;
    const auto P = InWalk(Stabilize(ReadFilmedScene(scene, std::nullopt), With(model), report, SilentProgress()), {});
    EXPECT_LT(JitterPx(walk, P), kJitterPx);
  }
}

TEST(HardCase, AnyProjectiveFrameOfConditionAMillionGivesTheSamePixels) {
  // In such a frame P and X, kept in doubles, tell the film itself to a few 1e-7 px only: the path can be no surer than
  // they are.
  constexpr double kSamePx = 1e-6, kTimesTheFilms = 100;
  const Walk walk = Sideways(60);
  for (const MotionModel model : {MotionModel::kSmooth, MotionModel::kLinear}) {
    StabilizeOptions options = With(model);
    options.min_scale = 0.9;
    const auto plain = Stabilized(walk, options);
    for (const unsigned seed : {1U, 2U, 3U}) {
      Telling telling;
      telling.world_from_walk = ProjectiveFrame(walk, 1e6, seed);
      const auto P = Stabilized(walk, options, telling);
      const Scene told = Told(walk, telling);
      double film_px = 0;
      for (const Point& point : told.points)
        for (const Observation& o : point.track)
          film_px = std::max(
              film_px,
              (Eigen::Vector3d(told.views[static_cast<std::size_t>(o.view.value)].P * point.X_in_world).hnormalized() -
               o.x_px)
                  .norm());
      const double apart = LargestDistancePx(walk, P, plain);
      EXPECT_LT(apart, std::max(kSamePx, kTimesTheFilms * film_px))
          << Name(model) << " " << seed << ": the film's own " << film_px;
      EXPECT_LT(apart, 1e-4);
    }
  }
}

TEST(HardCase, PointsMayCrossThePlaneAtInfinity) {
  // A cheirality plane that passes through the far points: a third of them lies on its other side.
  const Walk walk = Sideways(90);
  Telling telling;
  telling.plane_tilt = {0, 0, -1 / 12.0};
  const FilmedScene film = ReadWalk(walk, telling);
  int beyond = 0;
  for (const Eigen::Vector4d& X : film.X) beyond += film.plane_at_infinity.dot(X) < 0 ? 1 : 0;
  EXPECT_GT(beyond, 100);
  EXPECT_LT(JitterPx(walk, Stabilized(walk, With(MotionModel::kSmooth), telling)), kJitterPx);
  EXPECT_LT(JitterPx(walk, Stabilized(walk, With(MotionModel::kLinear), telling)), kFamilyPx);
}

TEST(HardCase, PointsThatTheCameraRunsIntoDoNotBendThePath) {
  // A few centimetres ahead of a camera that goes four a frame: in the next frame or the one after they lie in its
  // principal plane.
  const Walk walk = Forward(90);
  Scene scene = Told(walk);
  for (int t = 40; t < 60; ++t) {
    const Matrix34d& P = walk.shaky[static_cast<std::size_t>(t)];
    const Eigen::Vector3d eye = CentreOfProjection(P).hnormalized(), ahead = P.row(2).head<3>().normalized();
    Point point;
    point.X_in_world = Eigen::Vector3d(eye + 0.0402 * ahead).homogeneous();
    for (int s = t - 2; s <= t; ++s) {
      const Eigen::Vector3d q = walk.shaky[static_cast<std::size_t>(s)] * point.X_in_world;
      if (q.z() > 0) point.track.push_back({ViewId{s}, q.hnormalized()});
    }
    scene.points.push_back(point);
  }
  constexpr double kNearbyPx =
      1;  // 3.4 where they count in every frame; what is left of them is true parallax of a hand's breadth
  StabilizeOptions options = With(MotionModel::kSmooth);
  options.points = 1000;  // all of them
  StabilizeReport report;
  EXPECT_LT(
      JitterPx(walk, InWalk(Stabilize(ReadFilmedScene(scene, std::nullopt), options, report, SilentProgress()), {})),
      kNearbyPx);
}

TEST(HardCase, TheFixedObjectMayLeaveTheFrame) {
  Walk walk = Vertigo(120, 0.5);
  for (std::size_t t = 40; t < 120; ++t)
    for (const std::int32_t j : walk.object) walk.seen[t][static_cast<std::size_t>(j)] = 0;
  const auto P = Stabilized(walk, WithObject(walk));
  const auto sizes = ObjectSizes(walk, P);
  EXPECT_LT(*std::max_element(sizes.begin(), sizes.end()) / *std::min_element(sizes.begin(), sizes.end()) - 1, 0.01);
  EXPECT_LT(JitterPx(walk, P), kFamilyPx);
  // Nothing to be seen of it in the frame that the box speaks of.
  StabilizeOptions later = WithObject(walk);
  later.object_frame = 80;
  later.object_px = {0, 0, 3, 3};
  EXPECT_EQ(Refused([&] { Stabilized(walk, later); }).find("vertigo: "), 0U);
  later.object_frame = 200;
  EXPECT_FALSE(Refused([&] { Stabilized(walk, later); }, ExitCode::kUsage).empty());
  // And what does not come nearer has no vertigo.
  StabilizeOptions aside = With(MotionModel::kVertigo);
  aside.object_px = {200, 100, 240, 160};
  EXPECT_EQ(Refused([&] { Stabilized(Sideways(60, kStill), aside); }).find("vertigo: "), 0U);
}

TEST(HardCase, ARollingShuttersRowsDoNotShakeThePath) {
  const Walk walk = Forward(90);
  Scene scene = Told(walk);
  for (Point& point : scene.points)
    for (Observation& o : point.track) {
      const auto t = static_cast<std::size_t>(o.view.value);
      if (t + 1 >= walk.shaky.size()) continue;
      // Two thirds of a frame pass from the first row to the last: between this matrix and the next.
      const double row = 0.67 * (o.x_px.y() / kHeightPx - 0.5);
      const Eigen::Vector2d next = Eigen::Vector3d(walk.shaky[t + 1] * point.X_in_world).hnormalized();
      o.x_px += row * (next - o.x_px);
    }
  FilmFromItsSights(scene);
  double apart_px = 0;
  for (std::size_t t = 0; t < walk.shaky.size(); ++t)
    for (std::size_t j = 0; j < walk.X.size(); j += 20)
      if (walk.seen[t][j])
        apart_px = std::max(apart_px, (Eigen::Vector3d(scene.views[t].P * walk.X[j]).hnormalized() -
                                       Eigen::Vector3d(walk.shaky[t] * walk.X[j]).hnormalized())
                                          .norm());
  EXPECT_GT(apart_px, 1) << "the rows are in what the path is fitted to";
  for (Point& point : scene.points) PutWhereItWasSeen(scene, point);
  for (const MotionModel model : {MotionModel::kSmooth, MotionModel::kLinear}) {
    StabilizeReport report;
    EXPECT_LT(
        JitterPx(walk,
                 InWalk(Stabilize(ReadFilmedScene(scene, std::nullopt), With(model), report, SilentProgress()), {})),
        kJitterPx);
  }
}

TEST(HardCase, FramesMissingInTheMiddleDoNotBendThePath) {
  // 15 frames are gone: a constant velocity stays one. Times tell, and frame numbers where there are none.
  const Walk whole = Sideways(105, kStill);
  Walk walk = whole;
  const auto cut = [](auto& list) { list.erase(list.begin() + 45, list.begin() + 60); };
  cut(walk.ideal), cut(walk.shaky), cut(walk.seen);
  for (const bool timed : {true, false}) {
    Scene scene = Told(walk);
    for (std::size_t t = 45; t < scene.views.size(); ++t)
      scene.views[t].frame_index = static_cast<int>(t) + 15, scene.views[t].time_s = (t + 15.0) / kFps;
    if (!timed)
      for (View& view : scene.views) view.time_s.reset();
    for (const MotionModel model : {MotionModel::kSmooth, MotionModel::kLinear}) {
      StabilizeReport report;
      const auto P = InWalk(Stabilize(ReadFilmedScene(scene, std::nullopt), With(model), report, SilentProgress()), {});
      EXPECT_LT(LargestDistancePx(walk, P, walk.ideal), 0.1) << Name(model);
    }
  }
  Scene twice = Told(walk);
  twice.views[5].time_s = twice.views[4].time_s;
  EXPECT_NE(Refused([&] { ReadFilmedScene(twice, std::nullopt); }).find("times ascend"), std::string::npos);
}

}  // namespace
}  // namespace lumi
