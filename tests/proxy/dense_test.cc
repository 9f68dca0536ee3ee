#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "proxy/dense/depth_files.h"
#include "proxy/dense/depth_start.h"
#include "proxy/dense/fusion.h"
#include "proxy/dense/source_views.h"
#include "proxy/leave_out.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "tests/proxy/photographed_planes.h"

namespace lumi::test {
namespace {

std::vector<Photographed> PhotographAll(const std::vector<TexturedPlane>& world,
                                        const std::vector<StereoCamera>& cameras) {
  std::vector<Photographed> photos;
  for (const StereoCamera& camera : cameras) photos.push_back(Photograph(world, camera));
  return photos;
}

// The planes of sixteen pixels of a row.
struct Row16 {
  PatchBatch patches;
  PlaneBatch planes;
  std::array<int, kLanes> x;
  Row16(const Photographed& photo, int x0, int y, double w) {
    for (int l = 0; l < kLanes; ++l) x[static_cast<std::size_t>(l)] = x0 + 2 * l;
    MakePatches(photo.picture.grey, x.data(), y, patches);
    for (std::size_t l = 0; l < kLanes; ++l) planes.w[l] = static_cast<float>(w), planes.gx[l] = planes.gy[l] = 0;
  }
  std::array<float, kLanes> Score(const Photographed& reference, const Photographed& source) const {
    std::array<float, kLanes> cost;
    ScorePatches(patches, PackQuads(source.picture.grey), Pair(reference.picture.camera, source.picture.camera), planes,
                 cost.data());
    return cost;
  }
};

TEST(PatchScore, IsWhatItsFormulaSaysInDouble) {
  const std::vector<Photographed> photos =
      PhotographAll({Wall()}, {CameraAt({0, 0, 0}, {0, 0, 4}), CameraAt({0.4, 0.1, 0}, {0, 0, 4})});
  for (const double depth : {3.6, 4.0, 4.3}) {
    Row16 row(photos[0], 40, 60, 1 / depth);
    for (std::size_t l = 0; l < kLanes; ++l)
      row.planes.gx[l] = 1e-4F * static_cast<float>(l), row.planes.gy[l] = -2e-4F;
    const std::array<float, kLanes> cost = row.Score(photos[0], photos[1]);
    const StereoCamera &from = photos[0].picture.camera, &to = photos[1].picture.camera;
    for (std::size_t l = 0; l < kLanes; ++l) {
      double weights = 0, a = 0, b = 0, ab = 0, aa = 0, bb = 0;
      std::size_t s = 0;
      for (int dy = -6; dy <= 6; dy += 2) {
        for (int dx = -6; dx <= 6; dx += 2) {
          if (dx == 0 && dy == 0) continue;
          const double w = row.planes.w[l] + row.planes.gx[l] * dx + row.planes.gy[l] * dy;
          const Eigen::Vector3d x = to.cam_from_world * from.InWorld(row.x[l] + dx + 0.5, 60 + dy + 0.5, 1 / w);
          const Eigen::Vector2d px = x.head<2>().cwiseProduct(to.focal_px) / x.z() + to.centre_px;
          const double u = std::clamp(px.x() - 0.5, 0.0, to.width - 1.0),
                       v = std::clamp(px.y() - 0.5, 0.0, to.height - 1.0);
          const int i = static_cast<int>(u), j = static_cast<int>(v);
          const auto at = [&](int c, int r) {
            return static_cast<double>(
                photos[1].picture.grey.At(std::min(c, to.width - 1), std::min(r, to.height - 1), 0));
          };
          const double fu = u - i, fv = v - j;
          const double there = (1 - fv) * ((1 - fu) * at(i, j) + fu * at(i + 1, j)) +
                               fv * ((1 - fu) * at(i, j + 1) + fu * at(i + 1, j + 1));
          const double here = photos[0].picture.grey.At(row.x[l] + dx, 60 + dy, 0);
          const double weight = row.patches.weight[s++][l];
          weights += weight;
          a += weight * here, b += weight * there, ab += weight * here * there, aa += weight * here * here,
              bb += weight * there * there;
        }
      }
      EXPECT_NEAR(weights, 1, 1e-5);
      const double correlation = (ab - a * b) / std::sqrt((aa - a * a) * (bb - b * b));
      EXPECT_NEAR(cost[l], 1 - correlation, 2e-3)
          << "float pixels are off by 1e-5, code values by 1e-3; depth " << depth;
    }
  }
}

TEST(PatchScore, IsTheSameInRegistersOfEveryWidth) {
  constexpr double kRounding = 1e-4;  // of floats: pixels are off by 1e-5, steps between them are up to 100 code values
  const std::vector<Photographed> photos =
      PhotographAll({Wall()}, {CameraAt({0, 0, 0}, {0, 0, 4}), CameraAt({0.4, 0.1, 0}, {0, 0, 4})});
  const QuadImage quads = PackQuads(photos[1].picture.grey);
  const PairGeometry pair = Pair(photos[0].picture.camera, photos[1].picture.camera);
  // At the wall, off it, and a plane behind the cameras.
  for (const double w : {1 / 4.0, 1 / 3.0, -5.0}) {
    Row16 row(photos[0], 40, 60, w);
    for (std::size_t l = 0; l < kLanes; ++l) row.planes.gx[l] = 1e-3F * static_cast<float>(l);
    std::array<float, kLanes> narrow;
    ScorePatches(row.patches, quads, pair, row.planes, narrow.data(), 16);
    for (int bytes = 32; bytes <= WidestRegister(); bytes *= 2) {
      std::array<float, kLanes> wide;
      ScorePatches(row.patches, quads, pair, row.planes, wide.data(), bytes);
      for (std::size_t l = 0; l < kLanes; ++l)
        EXPECT_NEAR(wide[l], narrow[l], kRounding) << bytes << " bytes, pixel " << l << ", w " << w;
    }
  }
}

TEST(PatchScore, IsLeastAtTheTruthWhateverTheExposure) {
  const std::vector<StereoCamera> cameras = {CameraAt({0, 0, 0}, {0, 0, 4}), CameraAt({0.4, 0, 0}, {0.4, 0, 4})};
  const Photographed here = Photograph({Wall()}, cameras[0]), same = Photograph({Wall()}, cameras[1]);
  const Photographed darker = Photograph({Wall()}, cameras[1], 0.5, 20);
  const Row16 truth(here, 60, 60, 1 / 4.0), off(here, 60, 60, 1 / 3.8);
  for (std::size_t l = 0; l < kLanes; ++l) {
    EXPECT_LT(truth.Score(here, same)[l], 0.1);
    EXPECT_GT(off.Score(here, same)[l], truth.Score(here, same)[l] + 0.1);
    EXPECT_NEAR(truth.Score(here, darker)[l], truth.Score(here, same)[l], 0.02)
        << "rounding of half as many code values";
  }
}

TEST(PatchScore, SaysWhereThereIsNothingToCompare) {
  const StereoCamera camera = CameraAt({0, 0, 0}, {0, 0, 4}), away = CameraAt({0, 0, 0}, {0, 0, -4});
  const Photographed here = Photograph({Wall()}, camera), behind = Photograph({Wall()}, away);
  const Photographed flat =
      Photograph({{{0, 0, 4}, {6, 0, 0}, {0, 4.5, 0}, [](double, double) { return 120.0; }}}, camera);
  EXPECT_THAT(Row16(here, 60, 60, 0.25).Score(here, behind), testing::Each(kUnseen));
  EXPECT_THAT(Row16(here, 60, 60, 0.25).Score(here, flat), testing::Each(1.0F));
  EXPECT_THAT(Row16(flat, 60, 60, 0.25).Score(flat, here), testing::Each(1.0F));
}

TEST(PatchMatch, FindsASlantedFloorAndAWall) {
  const TexturedPlane floor{{0, 1, 3}, {4, 0, 0}, {0, 0, 3}, NoiseTexture(0.04, 7)};
  const std::vector<Photographed> photos = PhotographAll({Wall(5), floor}, RowOfCameras(5));
  const std::vector<DepthMap> maps = MatchAll(photos, 3, 1, 20);
  // The middle photos are overlapped on both sides. A patch is 13 px wide: what it cannot do is the fold between the
  // two.
  EXPECT_GT(ShareWithin(maps[2], photos[2], 0.01), 0.85);
}

TEST(PatchMatch, KeepsAThinPostBeforeAWall) {
  const TexturedPlane post{{0, 0, 2.5}, {0.08, 0, 0}, {0, 2, 0}, NoiseTexture(0.03, 9)};
  const std::vector<Photographed> photos = PhotographAll({Wall(5), post}, RowOfCameras(5, 0.15));
  const std::vector<DepthMap> maps = MatchAll(photos, 4, 1, 20);
  std::size_t pixels = 0, good = 0;
  for (std::size_t p = 0; p < photos[2].depth.size(); ++p) {
    if (!(photos[2].depth[p] < 3)) continue;  // 12 px wide: no wider than a patch
    ++pixels;
    good += std::abs(maps[2].w[p] * photos[2].depth[p] - 1) < 0.02;
  }
  EXPECT_GT(static_cast<double>(good) / static_cast<double>(pixels), 0.8);
  EXPECT_GT(ShareWithin(maps[2], photos[2], 0.02), 0.75) << "a wall's strip that one neighbour alone sees goes too";
}

TEST(PatchMatch, ClaimsNothingOnAWallWithoutTexture) {
  const TexturedPlane bare{{0, 0, 4}, {6, 0, 0}, {0, 4.5, 0}, [](double, double) { return 140.0; }};
  const std::vector<Photographed> photos = PhotographAll({bare}, RowOfCameras(3));
  const std::vector<DepthMap> maps = MatchAll(photos, 3, 1, 20);
  EXPECT_TRUE(std::ranges::all_of(maps[1].cost, [](float c) { return c > FusionOptions().max_cost; }));
}

TEST(PatchMatch, TellsRepeatedTextureApartByMoreThanTwoPhotos) {
  // Bars every 0.3: with one other photo several depths match, with four only one does.
  const TexturedPlane bars{{0, 0, 4}, {6, 0, 0}, {0, 4.5, 0}, [noise = NoiseTexture(0.05, 3)](double s, double t) {
                             return 0.75 * (std::fmod(std::abs(s) + 30, 0.3) < 0.15 ? 60 : 200) + 0.25 * noise(s, t);
                           }};
  const std::vector<Photographed> photos = PhotographAll({bars}, RowOfCameras(5, 0.22));
  EXPECT_GT(ShareWithin(MatchAll(photos, 3.3, 1, 20)[2], photos[2], 0.01), 0.8);
}

TEST(PatchMatch, TakesPhotosOfOtherExposuresAndSizes) {
  const std::vector<StereoCamera> row = RowOfCameras(3);
  std::vector<Photographed> photos = PhotographAll({Wall()}, row);
  photos[0] = Photograph({Wall()}, row[0], 0.6, 10);
  photos[2] = Photograph({Wall()}, Resized(row[2], 240, 180), 1.2, -10);
  const std::vector<DepthMap> maps = MatchAll(photos, 3, 1, 20);
  EXPECT_GT(ShareWithin(maps[1], photos[1], 0.01), 0.9);
  EXPECT_GT(ShareWithin(maps[2], photos[2], 0.01), 0.8);
}

TEST(PatchMatch, TwoPhotosAreEnough) {
  const std::vector<Photographed> photos = PhotographAll({Wall()}, RowOfCameras(2, 0.4));
  EXPECT_GT(ShareWithin(MatchAll(photos, 3, 1, 20)[0], photos[0], 0.01), 0.7) << "what both see";
}

TEST(PatchMatch, WhatAMaskIgnoresHasNoDepth) {
  std::vector<Photographed> photos = PhotographAll({Wall()}, RowOfCameras(3));
  photos[1].picture.ignored = Image8(160, 120, 1);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 40; ++x) photos[1].picture.ignored.At(x, y, 0) = 255;
  const DepthMap map = MatchAll(photos, 3, 1, 20)[1];
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) EXPECT_EQ(map.w[map.At(x, y)] == 0, x < 40);
}

TEST(PatchMatch, KeepsToItsSideOfASilhouette) {
  // A plate before a wall with the same texture on both: no colour tells where one ends.
  const std::vector<TexturedPlane> world = {Wall(), {{0, 0, 2.5}, {0.35, 0, 0}, {0, 0.3, 0}, NoiseTexture(0.04, 5)}};
  std::vector<Photographed> photos = PhotographAll(world, RowOfCameras(3, 0.12));
  // Right depths within eight pixels of the outline, on either side.
  const auto share = [&] {
    const DepthMap map = MatchAll(photos, 3, 1, 20)[1];
    const std::vector<double>& truth = photos[1].depth;
    long near = 0, good = 0;
    for (int y = 8; y < 112; ++y)
      for (int x = 8; x < 152; ++x) {
        bool at_outline = false;
        for (int d = -8; d <= 8; d += 4)
          at_outline = at_outline || std::abs(truth[map.At(x + d, y)] - truth[map.At(x, y)]) > 0.5;
        if (!at_outline) continue;
        ++near;
        good += std::abs(1 / map.w[map.At(x, y)] - truth[map.At(x, y)]) < 0.02 * truth[map.At(x, y)];
      }
    return static_cast<double>(good) / static_cast<double>(near);
  };
  const double without = share();
  for (Photographed& photo : photos) {
    photo.picture.object = Image8(160, 120, 1);
    for (std::size_t p = 0; p < photo.depth.size(); ++p)
      photo.picture.object.data[p] = photo.depth[p] > 0 && photo.depth[p] < 2.8 ? 255 : 0;
  }
  const double with = share();
  EXPECT_GT(with, 0.85);
  EXPECT_GT(with, without + 0.05);
}

TEST(PatchMatch, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Photographed> photos = PhotographAll({Wall()}, RowOfCameras(3));
  std::vector<std::vector<DepthMap>> maps;
  for (const int threads : {1, 2, 4}) {
    SetThreadCount(threads);
    maps.push_back(MatchAll(photos, 3, 1, 20));
  }
  SetThreadCount(0);
  for (const auto& of_threads : maps)
    for (std::size_t v = 0; v < photos.size(); ++v) {
      EXPECT_EQ(of_threads[v].w, maps[0][v].w);
      EXPECT_EQ(of_threads[v].gx, maps[0][v].gx);
      EXPECT_EQ(of_threads[v].cost, maps[0][v].cost);
    }
}

TEST(SourceViews, ShareManyPointsAtAnAngleThatShowsDepth) {
  const TemporaryFolder folder;
  std::vector<StereoCamera> cameras = RowOfCameras(6, 0.3);
  cameras.push_back(cameras[2]);  // a second photo from the same place
  const Scene scene = SceneOf({Wall()}, cameras, folder.path());
  const auto sources = PickSources(scene, 4);
  ASSERT_EQ(sources[2].size(), 4u);
  for (const SourceView& s : sources[2]) {
    EXPECT_NE(s.view.value, 6) << "shows no depth";
    EXPECT_GT(s.angle_deg, kSmallestAngleDeg);
    EXPECT_GT(s.shared, 10u);
  }
  EXPECT_GE(sources[2][0].score, sources[2][1].score);
}

TEST(SourceViews, CamerasThatOnlyTurnAreRefused) {
  const TemporaryFolder folder;
  std::vector<StereoCamera> cameras;
  for (int i = 0; i < 4; ++i) cameras.push_back(CameraAt({0, 0, 0}, {0.2 * i, 0, 4}));
  const Scene scene = SceneOf({Wall()}, cameras, folder.path());
  EXPECT_THROW(PickSources(scene, 4), DataError);
}

TEST(DepthStart, IsAffineBetweenThePointsOfAPlane) {
  const TemporaryFolder folder;
  const std::vector<StereoCamera> cameras = RowOfCameras(3);
  const Scene scene = SceneOf({Wall()}, cameras, folder.path());
  const Photographed photo = Photograph({Wall()}, cameras[1]);
  const DepthRange range = *RangeOf(scene, ViewId{1});
  EXPECT_GT(range.nearest_w, 1 / 4.0F);
  EXPECT_LT(range.farthest_w, 1 / 4.0F);
  EXPECT_GT(ShareWithin(StartingPlanes(scene, ViewId{1}, cameras[1], range), photo, 1e-3), 0.99);
}

FusionInput InputOf(const std::vector<Photographed>& photos, const std::vector<DepthMap>& maps) {
  FusionInput input;
  for (std::size_t v = 0; v < photos.size(); ++v) {
    input.partners.emplace_back();
    for (std::size_t o = 0; o < photos.size(); ++o)
      if (o != v) input.partners.back().push_back(static_cast<std::int32_t>(o));
  }
  input.load = [&](std::int32_t v) -> FusionMap {
    const auto i = static_cast<std::size_t>(v);
    return {photos[i].picture.camera, std::make_shared<const DepthMap>(maps[i])};
  };
  return input;
}

TEST(Fusion, MakesEachSurfaceOnceWhereMapsAgree) {
  const std::vector<Photographed> photos = PhotographAll({Wall()}, RowOfCameras(4));
  std::vector<DepthMap> maps;
  for (const Photographed& photo : photos) {
    maps.emplace_back(160, 120);
    for (std::size_t p = 0; p < photo.depth.size(); ++p) maps.back().w[p] = static_cast<float>(1 / photo.depth[p]);
  }
  // One map is wrong in its left half: nothing of it is kept there.
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 80; ++x) maps[3].w[maps[3].At(x, y)] *= 1.1F;
  const std::vector<ProxyPoint> points = FuseDepths(InputOf(photos, maps), {}, [] {});
  for (const ProxyPoint& p : points) {
    EXPECT_NEAR(p.x_in_world.z(), 4, 4e-3);
    if (p.views.size() < 3) {
      const auto looks = std::ranges::count_if(photos, [&](const Photographed& photo) {
        const StereoCamera& c = photo.picture.camera;
        const Eigen::Vector3d x = c.cam_from_world * p.x_in_world;
        const Eigen::Vector2d px = x.head<2>().cwiseProduct(c.focal_px) / x.z() + c.centre_px;
        return px.x() > 1 && px.y() > 1 && px.x() < c.width - 1 && px.y() < c.height - 1;
      });
      EXPECT_LE(looks, 2) << "at the row's ends, where all who look there agree";
    }
    EXPECT_TRUE(std::ranges::is_sorted(p.views));
    EXPECT_GT(p.sigma, 0.3 * p.footprint);
    EXPECT_NEAR(p.footprint, 4 / 192.0, 0.4 / 192);
  }
  EXPECT_GT(points.size(), 12000u);  // of 19,200 pixels a photo
  EXPECT_LT(points.size(), 30000u) << "what four photos see is there once, not four times";
}

TEST(Fusion, DropsWhatAMirrorShowsDifferentlyInEachPhoto) {
  // A plate on the wall that shows each camera something else, as a crumpled or curved mirror does.
  const std::vector<StereoCamera> cameras = RowOfCameras(5);
  std::vector<Photographed> photos;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto seed = static_cast<std::uint32_t>(100 + i);
    photos.push_back(
        Photograph({Wall(), {{0, 0, 3.999}, {0.6, 0, 0}, {0, 0.5, 0}, NoiseTexture(0.05, seed)}}, cameras[i]));
  }
  const std::vector<DepthMap> maps = MatchAll(photos, 3, 1, 20);
  // Points on the plate, and on as large a piece of the wall beside it; half a patch (6 px of 4/192) from the edge.
  const auto counts = [&](int agree) {
    FusionOptions options;
    options.agree = agree;
    std::array<long, 2> found{};
    for (const ProxyPoint& p : FuseDepths(InputOf(photos, maps), options, [] {})) {
      if (std::abs(p.x_in_world.y()) > 0.37) continue;
      if (std::abs(p.x_in_world.x()) < 0.47) ++found[0];
      if (std::abs(std::abs(p.x_in_world.x()) - 0.73 - 0.235) < 0.235) ++found[1];
    }
    return found;
  };
  const auto loose = counts(2), strict = counts(3);
  EXPECT_GT(loose[1], 1000);
  EXPECT_LT(loose[0], 0.05 * static_cast<double>(loose[1])) << loose[0] << " of " << loose[1];
  EXPECT_LE(strict[0], loose[0]);
}

TEST(Fusion, StricterAgreementKeepsFewerPointsAndThreadsDoNotMatter) {
  const std::vector<Photographed> photos = PhotographAll({Wall()}, RowOfCameras(4));
  const std::vector<DepthMap> maps = MatchAll(photos, 3, 1, 20);
  FusionOptions strict;
  strict.agree = 3;
  const std::vector<ProxyPoint> loose = FuseDepths(InputOf(photos, maps), {}, [] {});
  EXPECT_LT(FuseDepths(InputOf(photos, maps), strict, [] {}).size(), loose.size());
  SetThreadCount(1);
  const std::vector<ProxyPoint> alone = FuseDepths(InputOf(photos, maps), {}, [] {});
  SetThreadCount(0);
  ASSERT_EQ(alone.size(), loose.size());
  for (std::size_t p = 0; p < alone.size(); ++p) {
    EXPECT_EQ(alone[p].x_in_world, loose[p].x_in_world);
    EXPECT_EQ(alone[p].views, loose[p].views);
  }
}

TEST(DepthFiles, ColmapsMapsComeBack) {
  const TemporaryFolder folder;
  const std::vector<Photographed> photos =
      PhotographAll({{{0, 0, 4}, {6, 0, 2}, {0, 4.5, 1}, NoiseTexture(0.05, 1)}}, RowOfCameras(3));
  const DepthMap map = MatchAll(photos, 3, 1, 20)[1];
  const StereoCamera& camera = photos[1].picture.camera;
  WriteColmapDepth(folder.path(), "sub/a.jpg", camera, map, 0.4F);
  const ImageF depth = ReadColmapMatrix(folder.path() / "depth_maps" / "sub" / "a.jpg.geometric.bin");
  ASSERT_EQ(depth.width, 160);
  ASSERT_EQ(depth.height, 120);
  const auto back = ReadColmapDepth(folder.path(), "sub/a.jpg", Resized(camera, 320, 240));
  ASSERT_TRUE(back);
  std::size_t steep = 0;
  for (std::size_t p = 0; p < map.Pixels(); ++p) {
    const bool kept = map.cost[p] <= 0.4F;
    EXPECT_FLOAT_EQ(depth.data[p], kept ? 1 / map.w[p] : 0);
    if (!kept) continue;
    EXPECT_FLOAT_EQ(back->w[p], map.w[p]);
    if (back->gx[p] == 0) {
      ++steep;
      continue;
    }
    EXPECT_NEAR(back->gx[p], map.gx[p], 1e-3 * std::abs(map.gx[p]) + 1e-5 * map.w[p]);
    EXPECT_NEAR(back->gy[p], map.gy[p], 1e-3 * std::abs(map.gy[p]) + 1e-5 * map.w[p]);
  }
  EXPECT_LT(steep, map.Pixels() / 50);
  EXPECT_FALSE(ReadColmapDepth(folder.path(), "b.jpg", camera));
  EXPECT_THROW(ReadColmapDepth(folder.path(), "sub/a.jpg", Resized(camera, 120, 160)), InputError);
}

TEST(DepthFiles, CutAndCorruptOnesAreRefused) {
  const TemporaryFolder folder;
  ImageF matrix(7, 5, 1);
  WriteColmapMatrix(folder / "m.bin", matrix);
  DepthMap map(7, 5);
  WritePlanes(folder / "p.planes", map);
  for (const std::string name : {"m.bin", "p.planes"}) {
    const std::string whole = ReadText(folder / name);
    const auto read = [&](const std::string& bytes) {
      WriteTextAtomically(folder / name, bytes);
      name == "m.bin" ? void(ReadColmapMatrix(folder / name)) : void(ReadPlanes(folder / name));
    };
    for (std::size_t length = 0; length < whole.size(); length += 3)
      EXPECT_THROW(read(whole.substr(0, length)), InputError);
    EXPECT_THROW(read(whole + "x"), InputError);
    EXPECT_NO_THROW(read(whole));
  }
  for (const char* head :
       {"7&5&", "7&5&1", "-7&5&1&", "99999999999&5&1&", "70000&70000&1&", "a&b&c&", "7&5&99&", "0&0&0&"}) {
    WriteTextAtomically(folder / "m.bin", head);
    EXPECT_THROW(ReadColmapMatrix(folder / "m.bin"), InputError) << head;
  }
}

TEST(LeaveOut, DropsWhatPhotosSawAndPointsThatNeedThem) {
  const TemporaryFolder folder;
  const Scene scene = SceneOf({Wall()}, RowOfCameras(9), folder / "images");
  const std::vector<bool> keep = PhotosWithoutFolds(scene, 4, true);
  EXPECT_EQ(keep, (std::vector<bool>{false, true, false, true, false, true, false, true, false}));
  EXPECT_EQ(PhotosWithoutFolds(scene, 4, false),
            (std::vector<bool>{false, true, true, true, false, true, true, true, false}));
  Scene with_copy = scene;
  with_copy.views.push_back(scene.views[4]);  // a copy of a photo that is left out
  EXPECT_FALSE(PhotosWithoutFolds(with_copy, 4, true).back());
  EXPECT_FALSE(PhotosWithoutEach(with_copy, 4).back());
  EXPECT_TRUE(PhotosWithoutEach(with_copy, 3).back());
  const Scene less = WithPhotos(scene, keep);
  ASSERT_EQ(less.views.size(), 9u) << "cameras come from all photos";
  EXPECT_LE(less.points.size(), scene.points.size());
  EXPECT_GT(less.points.size(), scene.points.size() / 2);
  for (const Point& p : less.points) {
    EXPECT_GE(p.track.size(), 2u);
    for (const Observation& o : p.track) EXPECT_TRUE(keep[static_cast<std::size_t>(o.view.value)]);
  }
}

}  // namespace
}  // namespace lumi::test
