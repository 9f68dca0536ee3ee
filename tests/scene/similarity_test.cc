#include "scene/geometry/similarity3.h"

#include <gtest/gtest.h>

#include "random_scene.h"

namespace lumi {
namespace {

Similarity3 RandomSimilarity(test::Random& random) {
  return {random.Uniform(0.1, 10), random.Rotation(), random.InBox(20)};
}

TEST(Similarity, InverseAndProductAreConsistent) {
  test::Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Similarity3 a = RandomSimilarity(random), b = RandomSimilarity(random);
    const Eigen::Vector3d x = random.InBox(3);
    EXPECT_LT(((a * b) * x - a * (b * x)).norm(), 1e-11);
    EXPECT_LT((a.Inverse() * (a * x) - x).norm(), 1e-11);
  }
}

TEST(Similarity, AMovedWorldGivesTheSamePhoto) {
  test::Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Similarity3 s = RandomSimilarity(random);
    const Rigid3 pose = random.PoseAroundBox();
    const Rigid3 moved = TransformPose(pose, s);
    const Eigen::Vector3d x = random.InBox(1);
    // The camera frame grows with the world: directions stay.
    const Eigen::Vector3d a = pose * x, b = moved * (s * x);
    EXPECT_LT((s.scale * a - b).norm(), 1e-10 * b.norm() + 1e-10);
  }
}

TEST(Similarity, AlignmentRecoversWhatWasApplied) {
  test::Random random(3);
  for (int i = 0; i < 50; ++i) {
    const Similarity3 s = RandomSimilarity(random);
    std::vector<Eigen::Vector3d> a, b;
    for (int k = 0; k < 12; ++k) {
      a.push_back(random.InBox(2));
      b.push_back(s * a.back());
    }
    const Similarity3 found = AlignPoints(a, b);
    EXPECT_NEAR(found.scale, s.scale, 1e-11 * s.scale);
    EXPECT_LT(found.rotation.angularDistance(s.rotation), 1e-7);
    EXPECT_LT((found * a[0] - b[0]).norm(), 1e-10);
  }
}

TEST(Similarity, CollinearPointsAreRefusedCollinearCamerasAreNot) {
  test::Random random(4);
  const Similarity3 s = RandomSimilarity(random);
  std::vector<Eigen::Vector3d> a, b;
  std::vector<Rigid3> poses, moved;
  for (int k = 0; k < 6; ++k) {
    a.emplace_back(k * 0.5, 0, 0);
    b.push_back(s * a.back());
    const Eigen::Quaterniond q = random.Rotation();
    poses.push_back({q, -(q * a.back())});
    moved.push_back(TransformPose(poses.back(), s));
  }
  EXPECT_EQ(AlignPoints(a, b).scale, 0);
  const PoseErrors e = ComparePoses(poses, moved);
  EXPECT_LT(e.centre_max_percent, 1e-9);
  EXPECT_LT(e.rotation_max_deg, 1e-6);
}

// A straight walk, its centres a little off: a turn of the whole world around the path is not what was wrong.
TEST(Similarity, NoiseAcrossAThinPathIsNoTurn) {
  test::Random random(6);
  std::vector<Rigid3> truth, found;
  for (int k = 0; k < 30; ++k) {
    const Eigen::Quaterniond q = random.Rotation();
    const Eigen::Vector3d c(k, 0.01 * (k % 3), 0.01 * (k % 2)),
        off = 0.01 * Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1));
    truth.push_back({q, -(q * c)});
    found.push_back({q, -(q * (c + off))});
  }
  const PoseErrors e = ComparePoses(found, truth);
  EXPECT_LT(e.rotation_max_deg, 0.1);
  EXPECT_LT(e.centre_max_percent, 0.1);
}

TEST(Similarity, PoseErrorsAreInPercentOfTheExtentAndDegrees) {
  test::Random random(5);
  std::vector<Rigid3> truth;
  for (int k = 0; k < 8; ++k)
    truth.push_back(LookAt({(k & 1) * 1.0, ((k >> 1) & 1) * 1.0, (k >> 2) * 1.0}, {0.5, 0.5, 9}, {0, 1, 0}));
  std::vector<Rigid3> turned = truth;
  for (Rigid3& pose : turned) {
    const Eigen::Vector3d c = pose.OriginInSource();
    pose.rotation = Eigen::AngleAxisd(0.01745329252, Eigen::Vector3d::UnitZ()) * pose.rotation;
    pose.translation = -(pose.rotation * c);
  }
  EXPECT_NEAR(ComparePoses(turned, truth).rotation_rms_deg, 1.0, 1e-6);
  std::vector<Rigid3> shifted = truth;
  const Eigen::Vector3d c = truth[0].OriginInSource() + Eigen::Vector3d(0.01, 0, 0);
  shifted[0].translation = -(shifted[0].rotation * c);
  const PoseErrors e = ComparePoses(shifted, truth);
  // The alignment takes up a part: between half and all of 0.01 of the diagonal sqrt 3.
  EXPECT_GT(e.centre_max_percent, 0.5 * 1.0 / std::sqrt(3.0));
  EXPECT_LT(e.centre_max_percent, 1.0 / std::sqrt(3.0));
}

}  // namespace
}  // namespace lumi
