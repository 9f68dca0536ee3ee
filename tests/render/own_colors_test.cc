// lumi-render on photos whose white balance drifts, through a lens that is darker in its corners.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "capture_files.h"
#include "capture_with_tracks.h"
#include "render/commands/render_command.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

class OwnColors : public testing::Test {
 protected:
  using SummaryJson = nlohmann::ordered_json;

  void WriteCapture(bool changed) {
    test::Capture c = test::CaptureWithTracks(17, 96);
    for (std::size_t v = 0; changed && v < c.photos.size(); ++v) test::ShowAs(test::Drifted(v), 0.5, c.photos[v]);
    test::WriteAsScene(c, scene());
    names_.clear();
    for (const View& v : c.scene.views) names_.push_back(v.name);
  }
  std::filesystem::path scene() const { return folder_ / "scene"; }
  RenderOptions Options() const {
    RenderOptions o;
    o.scene = scene();
    return o;
  }
  RenderOptions HeldOut() const {
    RenderOptions o = Options();
    o.holdout = 4;
    return o;
  }
  static RenderOptions WithoutCorrections(RenderOptions o) {
    o.decided.Add({"white-balance", "vignetting"});
    return o;
  }
  static SummaryJson Run(const RenderOptions& o) {
    return SummaryJson::parse(JsonKeys(RunRender(o, SilentProgress())).Text());
  }
  static bool On(const SummaryJson& summary, const std::string& effect) {
    for (const SummaryJson& e : summary["effects"])
      if (e["name"] == effect) return e["on"];
    throw std::logic_error("no effect " + effect);
  }

  TemporaryFolder folder_;
  std::vector<std::string> names_;
};

TEST_F(OwnColors, AreTakenOutOnEvidenceAndHeldOutPhotosComeNearer) {
  WriteCapture(true);
  const SummaryJson corrected = Run(HeldOut()), as_taken = Run(WithoutCorrections(HeldOut()));
  for (const char* effect : {"exposure", "white-balance", "vignetting"}) EXPECT_TRUE(On(corrected, effect)) << effect;
  EXPECT_FALSE(On(as_taken, "white-balance") || On(as_taken, "vignetting"));
  // A third of a stop of drift and half of the light in the corners are worth decibels.
  EXPECT_GT(corrected["psnr_seen_mean_db"].get<double>(), as_taken["psnr_seen_mean_db"].get<double>() + 2);
}

TEST_F(OwnColors, AreGivenBackAtAPhotosOwnCamera) {
  WriteCapture(true);
  for (const char* backend : {"cpu", "gl"}) {
    RenderOptions o = Options();
    o.backend = backend;
    o.view = names_[5];
    o.output = folder_ / backend;
    const SummaryJson j = Run(o);
    EXPECT_TRUE(On(j, "vignetting"));
    // Two roundings to 8 bits, of which the first counts 1.5-fold in the middle.
    EXPECT_LT(j["views"][0]["mean_absolute_difference_seen"].get<double>(), 1) << backend;
  }
}

TEST_F(OwnColors, StayAsTheyAreWhereNothingCallsForAnything) {
  WriteCapture(false);
  RenderOptions o = Options();
  o.view = names_[5];
  o.leave_out = true;
  o.output = folder_ / "auto";
  EXPECT_FALSE(On(Run(o), "white-balance"));
  const Image8 by_evidence = ReadImage8(o.output / (names_[5].substr(0, names_[5].find('.')) + ".png"));
  o = WithoutCorrections(o);
  o.output = folder_ / "off";
  Run(o);
  EXPECT_EQ(by_evidence.data, ReadImage8(o.output / (names_[5].substr(0, names_[5].find('.')) + ".png")).data);
}

// A picture that is no photo's has the scene's colours: no corner is dark, and its brightness is that of the middles.
TEST_F(OwnColors, AreNotOfOtherViews) {
  WriteCapture(true);
  RenderOptions o = Options();
  o.output = folder_ / "path";
  o.seconds = 0.5;
  o.fps = 4;
  const SummaryJson corrected = Run(o);
  EXPECT_TRUE(On(corrected, "exposure"));
  const Image8 frame = ReadImage8(o.output / "frames" / "frame_000001.png", 3);
  double sum = 0;
  for (const std::uint8_t value : frame.data) sum += value;
  // The texture's mean is 128, drawn at 0.9 of it; corners that were left dark would take a tenth of it.
  EXPECT_NEAR(sum / static_cast<double>(frame.data.size()), 115, 8);
}

TEST_F(OwnColors, GoWithExposure) {
  WriteCapture(true);
  RenderOptions off = HeldOut();
  off.decided.Add("exposure");
  const SummaryJson j = Run(off);
  for (const char* effect : {"exposure", "white-balance", "vignetting"}) EXPECT_FALSE(On(j, effect)) << effect;
  off.settings.vignetting = true;
  off.decided.Add("vignetting");
  EXPECT_THROW(Run(off), UsageError);
  RenderOptions listed = HeldOut();
  listed.effects = "fov,vignetting";
  EXPECT_THROW(Run(listed), UsageError);
  listed.effects = "fov,exposure,vignetting";
  const SummaryJson both = Run(listed);
  EXPECT_TRUE(On(both, "vignetting"));
  EXPECT_FALSE(On(both, "white-balance"));
}

}  // namespace
}  // namespace lumi
