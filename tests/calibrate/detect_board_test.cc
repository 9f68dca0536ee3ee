#include "calibrate/detect_board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrate/fit.h"
#include "scene/undistort/undistorter.h"
#include "tests/calibrate/rendered_boards.h"

namespace lumi::test {
namespace {

using testing::HasSubstr;

const BoardRenderer& Renderer() {
  static const BoardRenderer renderer(TrueIntrinsics());
  return renderer;
}

// A board and itself turned by half a turn may be numbered either way.
double MeanError(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b) {
  double sum = 0, turned = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (a[i] - b[i]).norm();
    turned += (a[i] - b[a.size() - 1 - i]).norm();
  }
  return std::min(sum, turned) / static_cast<double>(a.size());
}

TEST(Detection, FindsTheBoardAtAnyRotation) {
  const Intrinsics k = TrueIntrinsics();
  for (int degrees = 0; degrees < 360; degrees += 60) {
    const Rigid3 pose = PoseOf({0, 0, 520, 15, -20, static_cast<double>(degrees)}, k);
    const BoardSearch search = FindBoard(Renderer()(pose), kBoard);
    ASSERT_TRUE(search.found) << degrees << ": " << search.why_not;
    // A tenth of a pixel; half a pixel would be a convention of pixel centres gone wrong.
    EXPECT_LT(MeanError(search.found->corners_px, Seen(pose, k, "").corners_px), 0.1) << degrees;
  }
}

// Searched in a smaller picture, refined in the photo itself.
TEST(Detection, FindsTheBoardInALargePhoto) {
  Intrinsics k = TrueIntrinsics();
  for (const Term term : {kFx, kCx, kCy, kSkew}) k[term] *= 2.75;
  const BoardRenderer renderer(k, 1760, 1320);
  const Rigid3 pose = PoseOf({0.1, 0, 520, 15, -20, 30}, TrueIntrinsics());
  const BoardSearch search = FindBoard(renderer(pose), kBoard);
  ASSERT_TRUE(search.found) << search.why_not;
  EXPECT_LT(MeanError(search.found->corners_px, Seen(pose, k, "").corners_px), 0.15);
}

TEST(Detection, RefusesAPartOfABoard) {
  const BoardSearch search = FindBoard(Renderer()(PoseOf({0.9, 0, 400, 5, 5, 0}, TrueIntrinsics())), kBoard);
  EXPECT_FALSE(search.found);
  EXPECT_FALSE(search.why_not.empty());
}

TEST(Detection, NamesTheSizeOfAnotherBoard) {
  const Image8 photo = Renderer()(PoseOf({0, 0, 480, 12, -9, 4}, TrueIntrinsics()));
  for (const Board& wrong : {Board{8, 6, 25}, Board{10, 7, 25}, Board{7, 5, 25}}) {
    const BoardSearch search = FindBoard(photo, wrong);
    EXPECT_FALSE(search.found) << wrong.columns;
    EXPECT_THAT(search.why_not, HasSubstr("9x6"));
  }
}

TEST(Detection, HasNoAnswerWithoutABoard) {
  EXPECT_FALSE(FindBoard(Image8(200, 150, 3, 128), kBoard).found);
  EXPECT_FALSE(FindBoard(Image8(8, 8, 3, 128), kBoard).found);
}

// Distortion and skew included; photos with noise, corners by the detector: within three of its own standard
// deviations.
TEST(RenderedBoards, GiveTheIntrinsicsWithinThreeSigma) {
  const Intrinsics k = TrueIntrinsics();
  std::vector<BoardSearch> searches(GoodPoses().size());
  const BoardRenderer& renderer = Renderer();
  ParallelFor(searches.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      TruePose farther = GoodPoses()[i];
      farther.distance_mm *= 1.15;
      searches[i] = FindBoard(renderer(PoseOf(farther, k), kBoard, 5, static_cast<unsigned>(i)), kBoard);
    }
  });
  std::vector<BoardView> views;
  for (std::size_t i = 0; i < searches.size(); ++i)
    if (searches[i].found) views.push_back({"view" + std::to_string(i), searches[i].found->corners_px, {}});
  ASSERT_GE(views.size(), 10U);
  const FitResult fit = Fit(kBoard, views, kWidthPx, kHeightPx, {});
  const Calibration& c = fit.calibration;
  std::printf("%zu views, model %s, noise %.4f px\n", fit.views.size(), c.model.name.c_str(), c.noise_px);
  EXPECT_LT(c.noise_px, 0.1);
  for (const Term term : {kFx, kCx, kCy, kSkew, kK1, kK2}) {
    EXPECT_TRUE(c.model.free[static_cast<std::size_t>(term)]) << term;
    const double sigma = c.Sigma(term, c.noise_px);
    std::printf("term %d: %.5f, truth %.5f, off by %.2f sigma\n", static_cast<int>(term), c.intrinsics[term], k[term],
                (c.intrinsics[term] - k[term]) / sigma);
    EXPECT_LT(std::abs(c.intrinsics[term] - k[term]), 3 * sigma) << term;
  }
  EXPECT_LT(std::abs(c.Fy() - k[kFx] * k[kAspect]), 3 * c.SigmaFy(c.noise_px));
}

TEST(Undistorted, ShowsAPinholeWithoutSkew) {
  const Intrinsics k = TrueIntrinsics();
  const Rigid3 pose = PoseOf({0.1, 0.05, 480, 18, -14, 6}, k);
  const Camera camera = CameraOf(k, kWidthPx, kHeightPx);
  const Camera pinhole = PinholeInside(camera);
  const BoardSearch search = FindBoard(Undistorter(camera, pinhole)(Renderer()(pose)), kBoard);
  ASSERT_TRUE(search.found) << search.why_not;
  std::vector<Eigen::Vector2d> expected;
  for (const Eigen::Vector2d& x : kBoard.Corners())
    expected.push_back(*pinhole.Project(pose * Eigen::Vector3d(x.x(), x.y(), 0)));
  EXPECT_LT(MeanError(search.found->corners_px, expected), 0.1);
  // Every pixel of it comes from inside the photo.
  for (const double x : {0.5, kWidthPx / 2.0, kWidthPx - 0.5})
    for (const double y : {0.5, kHeightPx / 2.0, kHeightPx - 0.5}) {
      const Eigen::Vector2d source = ProjectNormalized(k, *pinhole.Normalized({x, y}));
      EXPECT_TRUE(source.x() >= 0 && source.y() >= 0 && source.x() <= kWidthPx && source.y() <= kHeightPx)
          << x << " " << y;
    }
}

}  // namespace
}  // namespace lumi::test
