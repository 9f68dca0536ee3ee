#include "render/holdout/evaluation_proxy.h"

#include <gtest/gtest.h>

#include "render/holdout/holdout.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"

namespace lumi {
namespace {

class ProxyForPhotos : public testing::Test {
 protected:
  void Make(const std::string& name) const {
    Mesh m;
    m.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    m.faces = {{0, 1, 2}};
    WriteMesh(ProxyPath(folder_.path(), name), m);
  }
  std::string Of(int holdout, int photo = 0, const std::string& name = "mesh") const {
    return ProxyFor(folder_.path(), name, holdout, {photo});
  }

  TemporaryFolder folder_;
};

TEST_F(ProxyForPhotos, IsTheOneMadeWithoutThem) {
  EXPECT_EQ(Of(8), "mesh") << "there is no other";
  Make("mesh");
  Make(ProxyWithout("mesh", 8));
  EXPECT_EQ(ProxyWithout("mesh", 8), "mesh-without-8");
  EXPECT_EQ(Of(8), "mesh-without-8");
  EXPECT_EQ(Of(8, 16), "mesh-without-8");
  EXPECT_EQ(Of(8, 0, "hull"), "hull") << "another proxy";
  EXPECT_EQ(Of(kHoldoutEach, 3), "mesh");
}

TEST_F(ProxyForPhotos, MayBeWithoutMorePhotosThanAreHeldOut) {
  Make(ProxyWithout("mesh", 4));
  Make(ProxyWithout("mesh", 8));
  EXPECT_EQ(Of(24), "mesh-without-8") << "both serve, and 8 leaves out fewer";
  EXPECT_EQ(Of(12), "mesh-without-4");
  EXPECT_EQ(Of(2), "mesh") << "without 4 some photos that 2 holds out were looked at";
  EXPECT_EQ(Of(9), "mesh");
  // What that rests on: all photos of N's folds are in M's.
  Scene scene;
  scene.views.resize(200);
  for (const int m : {2, 3, 4, 5, 8, 9})
    for (const int factor : {1, 2, 3, 4, 5}) {
      std::vector<bool> without(scene.views.size(), false);
      for (const Fold fold : {Fold::kReport, Fold::kChoose})
        for (const ViewId id : FoldViews(scene, m, fold)) without[static_cast<std::size_t>(id.value)] = true;
      for (const Fold fold : {Fold::kReport, Fold::kChoose})
        for (const ViewId id : FoldViews(scene, m * factor, fold))
          EXPECT_TRUE(without[static_cast<std::size_t>(id.value)]) << m << " " << factor << ": photo " << id.value;
    }
}

TEST_F(ProxyForPhotos, LeftOutEachInTurnIsOfThePhotosFold) {
  for (int k = 0; k + 1 < kProxiesForEach; ++k) Make(ProxyWithoutEach("mesh", k));
  EXPECT_EQ(Of(kHoldoutEach, 3), "mesh") << "one is missing: all photos are rendered over the same kind of proxy";
  Make(ProxyWithoutEach("mesh", kProxiesForEach - 1));
  EXPECT_EQ(Of(kHoldoutEach, 0), "mesh-without-each-0-of-5");
  EXPECT_EQ(Of(kHoldoutEach, 4), "mesh-without-each-4-of-5");
  EXPECT_EQ(Of(kHoldoutEach, 13), "mesh-without-each-3-of-5");
  EXPECT_EQ(Of(8), "mesh");
}

TEST_F(ProxyForPhotos, OfAllPhotosIsSaidToHaveSeenThoseItIsJudgedBy) {
  const auto recorded = [&](const char* kind, bool leaves_out) {
    Provenance p;
    p.stage = "proxy-mesh";
    p.options["kind"] = kind;
    if (leaves_out) p.options["leave_out"] = "8";
    WriteProvenance(folder_.path(), p);
    return RemarkOnProxyThatSaw(folder_.path(), "mesh", 8);
  };
  EXPECT_EQ(RemarkOnProxyThatSaw(folder_.path(), "mesh", 8), "") << "nobody knows";
  EXPECT_NE(recorded("dense", false).find("lumi-proxy dense " + folder_.path().string() + " --leave-out 8"),
            std::string::npos);
  EXPECT_NE(recorded("hull", false), "");
  EXPECT_EQ(recorded("hull", false).find("--leave-out"), std::string::npos) << "hulls have no such option";
  EXPECT_EQ(recorded("dense", true), "");
  EXPECT_EQ(recorded("import", false), "") << "made elsewhere";
}

}  // namespace
}  // namespace lumi
