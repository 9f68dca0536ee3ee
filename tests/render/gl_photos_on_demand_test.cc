// The GL backend where not all photos fit into graphics memory.
#include <gtest/gtest.h>

#include "capture_files.h"
#include "render/path/camera_path.h"
#include "render/photos/photo_cache.h"
#include "render/world/renderer.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

class GlPhotosOnDemand : public testing::Test {
 protected:
  static constexpr int kPhotos = 40;
  void SetUp() override {
    capture_ = test::MakeCapture(kPhotos, 128);
    test::WriteAsScene(capture_, folder_.path());
    one_ = PhotoCache::BytesOf(capture_.scene) / kPhotos;
    try {
      all_ = MakeGlRenderer(WorldOf(capture_.scene, capture_.proxy), capture_.photos);
    } catch (const MachineError& e) {
      GTEST_SKIP() << "OpenGL 4.3 is not available: " << e.what();
    }
  }
  // graphics: photos that graphics memory holds, about.
  std::unique_ptr<Renderer> Some(PhotoCache& cache, double graphics) {
    return MakeGlRenderer(WorldOf(capture_.scene, capture_.proxy), cache.photos(),
                          {[&](std::span<const WantedPhoto> wanted) { return cache.Bring(wanted); }, 0, 2 * one_,
                           static_cast<std::size_t>(graphics * 4.0 / 3.0 * static_cast<double>(one_))});
  }
  // Between this photo's camera and the next one's.
  RenderRequest At(int view) const {
    const auto camera = [&](int v) -> const Rigid3& {
      return capture_.scene.views[static_cast<std::size_t>(v % kPhotos)].cam_from_world;
    };
    PathKey key;
    key.cam_from_world = camera(view);
    const Eigen::Vector3d centre =
        0.6 * camera(view).OriginInSource() + 0.4 * camera((view + 1) % kPhotos).OriginInSource();
    key.cam_from_world.translation = -(key.cam_from_world.rotation * centre);
    key.vertical_fov_rad = 0.4;
    RenderRequest request;
    request.view = MakeRenderView(key, 40, 96);
    request.settings.k = 2;
    return request;
  }
  TemporaryFolder folder_;
  test::Capture capture_;
  std::size_t one_ = 0;
  std::unique_ptr<Renderer> all_;
};

TEST_F(GlPhotosOnDemand, PicturesAreTheSameWhereAPicturesOwnPhotosFit) {
  for (const auto& [columns, sampling] : {std::pair(0, Sampling::kCandidates), std::pair(9, Sampling::kCandidates),
                                          std::pair(9, Sampling::kInterpolated)}) {
    PhotoCache cache(capture_.scene, 2 * one_);
    // More slots than photos in a picture, fewer than photos in all.
    const auto some = Some(cache, kPhotos - 1);
    for (const int view : {0, 39, 20, 0}) {
      RenderRequest request = At(view);
      request.settings.grid_columns = request.settings.grid_rows = columns;
      request.settings.sampling = sampling;
      EXPECT_EQ(some->Render(request).data, all_->Render(request).data) << columns << " " << view;
      EXPECT_EQ(some->Statistics().halved, 0);
      EXPECT_GT(some->Statistics().photo_bytes, 0U);
      EXPECT_LT(some->Statistics().photo_bytes, static_cast<std::size_t>(kPhotos) * one_ * 4 / 3);
    }
    // The last picture's photos were still there.
    some->Render(At(0));
    const long read = cache.counts().read;
    some->Render(At(0));
    EXPECT_EQ(cache.counts().read, read);
  }
}

// Small photos stand in for whole ones: less sharp, never a hole.
TEST_F(GlPhotosOnDemand, WhatDoesNotFitIsSmallAndNoHole) {
  PhotoCache cache(capture_.scene, 2 * one_);
  const auto some = Some(cache, 2);
  for (const int view : {0, 20, 39}) {
    const ImageF a = some->Render(At(view)), b = all_->Render(At(view));
    EXPECT_GT(some->Statistics().halved, 0);
    EXPECT_LE(some->Statistics().photo_bytes, 2 * one_ * 4 / 3);
    for (std::size_t i = 3; i < a.data.size(); i += 4) ASSERT_NEAR(a.data[i], b.data[i], 1e-6) << i / 4;
    constexpr double kBlurredDb = 18;
    EXPECT_GT(test::PsnrDb(a, b), kBlurredDb) << view;
  }
}

TEST_F(GlPhotosOnDemand, FalseColoursNeedNoPhotos) {
  PhotoCache cache(capture_.scene, 2 * one_);
  const auto some = Some(cache, 2);
  RenderRequest request = At(4);
  request.show = Show::kFalseColor;
  EXPECT_EQ(some->Render(request).data, all_->Render(request).data);
  EXPECT_EQ(cache.counts().read, 0);
}

TEST_F(GlPhotosOnDemand, APhotoThatIsGoneIsNamed) {
  PhotoCache cache(capture_.scene, 2 * one_);
  const auto some = Some(cache, 4);
  std::filesystem::remove(capture_.scene.image_folder / capture_.scene.views[4].name);
  try {
    some->Render(At(4));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.file().filename(), capture_.scene.views[4].name);
  }
}

}  // namespace
}  // namespace lumi
