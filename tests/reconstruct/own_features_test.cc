// What is written into COLMAP's database here: COLMAP goes on from it, a killed run's part is gone on from, and nothing
// depends on the number of threads.
#include "reconstruct/own_features.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "reconstruct/colmap_database.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/geometry/similarity3.h"
#include "scene/program/parallel.h"
#include "tests/reconstruct/database_fixture.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

// Views of points on a bowl of random relief, each point with a descriptor of its own, a little different in each view.
struct Views {
  std::vector<std::string> names;
  std::vector<Rigid3> cam_from_world;
  std::vector<DatabasePhoto> photos;
  Camera camera = Camera::Pinhole(640, 480, 620, 620, 320, 240);
};

Views Simulate(int count, int points, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(-1, 1);
  std::normal_distribution<double> noise(0, 0.2);
  std::gamma_distribution<float> number(1.0F);
  std::vector<Eigen::Vector3d> x_in_world;
  Descriptors of_points(points, kByteDescriptorLength);
  for (int p = 0; p < points; ++p) {
    x_in_world.emplace_back(2 * part(random), 1.5 * part(random), 0.8 * part(random));
    for (int k = 0; k < kByteDescriptorLength; ++k) of_points(p, k) = number(random);
  }
  Views views;
  for (int v = 0; v < count; ++v) {
    const double angle = 0.12 * (v - 0.5 * (count - 1));
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    const Eigen::Vector3d centre = turn.inverse() * Eigen::Vector3d(0, 0.7 * (v % 3 - 1), -5);
    views.cam_from_world.push_back({turn, -(turn * centre)});
    views.names.push_back("view_" + std::to_string(v) + ".jpg");
    DatabasePhoto photo;
    photo.id = v + 1;
    photo.name = views.names.back();
    std::vector<int> seen;
    for (int p = 0; p < points; ++p) {
      const auto x = views.camera.Project(views.cam_from_world.back() * x_in_world[static_cast<std::size_t>(p)]);
      if (!x || x->x() < 0 || x->y() < 0 || x->x() > 640 || x->y() > 480) continue;
      photo.features.push_back({*x + Eigen::Vector2d(noise(random), noise(random)), 2, 0.3});
      seen.push_back(p);
    }
    Descriptors d(static_cast<Eigen::Index>(seen.size()), kByteDescriptorLength);
    for (Eigen::Index i = 0; i < d.rows(); ++i) {
      for (int k = 0; k < kByteDescriptorLength; ++k)
        d(i, k) = of_points(seen[static_cast<std::size_t>(i)], k) * (1 + 0.1F * static_cast<float>(noise(random)));
      d.row(i).normalize();
    }
    photo.descriptors = ToBytes(d);
    views.photos.push_back(std::move(photo));
  }
  return views;
}

std::vector<std::pair<int, int>> AllPairs(std::size_t n) {
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) pairs.emplace_back(a, b);
  return pairs;
}

class OwnFeatures : public ::testing::Test {
 protected:
  OwnFeatures() : folder_("own-features"), colmap_(folder_.path() / "colmap.log", SilentProgress()) {
    options_.seed = 3;
  }
  fs::path Path(const std::string& name) const { return folder_.path() / name; }
  ColmapJob Job() { return {options_, folder_.path(), colmap_, SilentProgress()}; }

  void Make(const fs::path& database) {
    ASSERT_TRUE(FindOwnFeatures({}, database, Job())) << "this COLMAP's tables are not written here";
  }
  void Write(const Views& views, const fs::path& database) {
    Make(database);
    ColmapDatabase db(database);
    std::int64_t camera = 0;
    for (DatabasePhoto photo : views.photos) {
      if (camera == 0) photo.camera = views.camera;
      photo.camera_id = camera;
      camera = db.AddPhoto(photo);
    }
  }
  // Everything that COLMAP reads of matches.
  static std::string Matches(const fs::path& database) {
    const ColmapDatabase db(database);
    std::string all;
    for (const DatabasePair& pair : db.MatchedPairs()) {
      all += std::to_string(pair.image1) + "-" + std::to_string(pair.image2) + ":";
      for (const auto& [i, j] : db.Matches(pair.image1, pair.image2))
        all += " " + std::to_string(i) + "," + std::to_string(j);
      all += "\n";
    }
    for (const DatabasePair& pair : db.VerifiedPairs())
      all +=
          std::to_string(pair.image1) + "-" + std::to_string(pair.image2) + "=" + std::to_string(pair.matches) + "\n";
    return all;
  }

  FixtureFolder folder_;
  ReconstructOptions options_;
  ColmapProgram colmap_;
};

TEST_F(OwnFeatures, WhatIsWrittenIsReadBack) {
  const Views views = Simulate(3, 300);
  Write(views, Path("a.db"));
  const ColmapDatabase db(Path("a.db"));
  const auto images = db.Images();
  ASSERT_EQ(images.size(), 3U);
  ASSERT_EQ(db.Cameras().size(), 1U);
  EXPECT_EQ(db.Cameras()[0].camera.params, views.camera.params);
  EXPECT_FALSE(db.Cameras()[0].focal_is_known);
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_EQ(images[v].name, views.names[v]);
    EXPECT_EQ(images[v].keypoints, static_cast<int>(views.photos[v].features.size()));
    EXPECT_EQ(db.Descriptors(images[v].id), views.photos[v].descriptors);
    const auto keypoints = db.Keypoints(images[v].id);
    for (std::size_t i = 0; i < keypoints.size(); ++i)
      EXPECT_EQ(keypoints[i], views.photos[v].features[i].x_px.cast<float>().cast<double>());
  }
}

// From matches and geometries that are written here, COLMAP's mapper places the cameras where they were.
TEST_F(OwnFeatures, ColmapGoesOnFromTheDatabase) {
  const Views views = Simulate(6, 250);
  Write(views, Path("a.db"));
  MatchOwnFeatures(views.names, AllPairs(6), Path("a.db"), Job());
  EXPECT_EQ(ColmapDatabase(Path("a.db")).VerifiedPairs().size(), 15U);
  fs::create_directories(Path("sparse"));
  fs::create_directories(Path("images"));
  for (const auto& name : views.names) WriteImage(Path("images") / name, Image8(640, 480, 3, 90));
  colmap_.Run("mapper",
              {{"database_path", Path("a.db").string()},
               {"image_path", Path("images").string()},
               {"output_path", Path("sparse").string()},
               {"Mapper.ba_refine_focal_length", "0"},
               {"random_seed", "1", false}},
              "mapping", 0);
  const Scene scene = ReadColmapModel(Path("sparse") / "0");
  ASSERT_EQ(scene.views.size(), 6U);
  EXPECT_GT(scene.points.size(), 200U);
  std::vector<Rigid3> found, truth;
  for (const View& view : scene.views) {
    found.push_back(view.cam_from_world);
    truth.push_back(views.cam_from_world[static_cast<std::size_t>(view.name[5] - '0')]);
  }
  // 0.2 px of noise on 200 points and more at 620 px: 0.02 degree a point, a tenth of it for all.
  const PoseErrors errors = ComparePoses(found, truth);
  EXPECT_LT(errors.rotation_rms_deg, 0.05);
  EXPECT_LT(errors.centre_rms_percent, 0.3);
}

TEST_F(OwnFeatures, SameMatchesWhateverTheNumberOfThreadsAndWhereverARunWasEnded) {
  const Views views = Simulate(7, 400);
  std::string first;
  for (const int threads : {1, 3}) {
    const fs::path database = Path("threads-" + std::to_string(threads) + ".db");
    Write(views, database);
    SetThreadCount(threads);
    MatchOwnFeatures(views.names, AllPairs(7), database, Job());
    SetThreadCount(0);
    const std::string matches = Matches(database);
    if (threads == 1) first = matches;
    EXPECT_EQ(matches, first);
  }
  EXPECT_GT(first.size(), 10000U);
  // A run that matched these only, then all.
  const fs::path database = Path("ended.db");
  Write(views, database);
  MatchOwnFeatures(views.names, {{0, 1}, {2, 5}, {3, 4}}, database, Job());
  EXPECT_NE(Matches(database), first);
  MatchOwnFeatures(views.names, AllPairs(7), database, Job());
  EXPECT_EQ(Matches(database), first);
}

// Photos with hardly anything in common are told from those with much by their largest features, and only where each
// has partners enough.
TEST_F(OwnFeatures, PairsThatShareNothingAreNotMatchedInFull) {
  Views views = Simulate(8, 1400, 1), others = Simulate(8, 1400, 2);
  for (DatabasePhoto& photo : others.photos) {
    photo.id += 8;
    photo.name = "z" + photo.name;
    views.names.push_back(photo.name);
    views.photos.push_back(photo);
  }
  Write(views, Path("a.db"));
  struct Messages : ProgressSink {
    std::string all;
    void Report(const std::string&, long, long, double, double) override {}
    void Finish(const std::string&, long, double) override {}
    void Message(const std::string& line) override { all += line + "\n"; }
  } messages;
  MatchOwnFeatures(views.names, AllPairs(16), Path("a.db"), {options_, folder_.path(), colmap_, messages});
  EXPECT_NE(messages.all.find("64 of 120 pairs of photos were not matched"), std::string::npos) << messages.all;
  const ColmapDatabase db(Path("a.db"));
  EXPECT_EQ(db.MatchedPairs().size(), 120U);  // nothing is left to do
  EXPECT_EQ(db.VerifiedPairs().size(), 56U);
  for (const DatabasePair& pair : db.VerifiedPairs()) EXPECT_EQ(pair.image1 <= 8, pair.image2 <= 8);
}

// Photos of two sizes, one of them portrait; one that cannot be read; and one more that comes later.
TEST_F(OwnFeatures, PhotosAreFoundOnceEachWithTheirOwnCameras) {
  std::mt19937 random(4);
  std::uniform_int_distribution<int> byte(0, 255);
  const auto write = [&](const std::string& name, int width, int height) {
    Image8 coarse(width / 8, height / 8, 3);
    for (auto& v : coarse.data) v = static_cast<std::uint8_t>(byte(random));
    WriteImage(Path("photos") / name, Resize(coarse, width, height));
    InputPhoto photo;
    photo.name = name;
    photo.width_px = width;
    photo.height_px = height;
    return photo;
  };
  fs::create_directories(Path("photos"));
  PhotosToSearch search{.folder = Path("photos"), .photos = {}, .masks = {}, .cameras = {}, .limits = {800, 500}};
  search.photos = {write("a.png", 320, 240), write("b.png", 240, 320), write("c.png", 320, 240)};
  InputPhoto broken = search.photos[2];
  broken.name = "broken.png";
  search.photos.insert(search.photos.begin() + 2, broken);
  ASSERT_TRUE(FindOwnFeatures(search, Path("a.db"), Job()));
  const auto before = ColmapDatabase(Path("a.db")).Images();
  ASSERT_EQ(before.size(), 3U);
  for (const auto& image : before) {
    EXPECT_GT(image.keypoints, 100) << image.name;
    EXPECT_LE(image.keypoints, 500) << image.name;
  }
  for (const auto& entry : ColmapDatabase(Path("a.db")).Cameras()) {
    const bool portrait = entry.id == before[1].camera_id;
    EXPECT_EQ(entry.camera.width_px, portrait ? 240 : 320);
    EXPECT_EQ(entry.camera.FocalPx().x(), 1.2 * 320);
  }
  search.photos.push_back(write("d.png", 320, 240));
  ASSERT_TRUE(FindOwnFeatures(search, Path("a.db"), Job()));
  const auto after = ColmapDatabase(Path("a.db")).Images();
  ASSERT_EQ(after.size(), 4U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(after[i].id, before[i].id);
  // One camera for all where they share one.
  search.cameras.shared = true;
  search.photos = {search.photos[0], search.photos[3]};  // a, c
  ASSERT_TRUE(FindOwnFeatures(search, Path("b.db"), Job()));
  EXPECT_EQ(ColmapDatabase(Path("b.db")).Cameras().size(), 1U);
}

}  // namespace
}  // namespace lumi
