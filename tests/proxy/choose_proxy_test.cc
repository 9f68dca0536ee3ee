#include "proxy/choose_proxy.h"

#include <gtest/gtest.h>

namespace lumi::test {
namespace {

ProxyCandidate Measured(const std::string& name, double psnr_db, double ssim, std::size_t faces = 100, double ms = 10) {
  ProxyCandidate c;
  c.name = name;
  c.psnr_db = psnr_db, c.ssim = ssim, c.coverage = 1, c.ms = ms;
  c.faces = faces;
  return c;
}

std::string Chosen(std::vector<ProxyCandidate> candidates, std::optional<double> budget_ms = std::nullopt) {
  AutoTable table;
  table.candidates = std::move(candidates);
  return ChooseProxy(table, budget_ms).first->name;
}

TEST(ChooseProxy, TakesTheHighestPsnrAndTellsAlikeOnesApartBySsim) {
  EXPECT_EQ(Chosen({Measured("plane", 23, 0.6), Measured("delaunay", 27.2, 0.90), Measured("dense", 27.0, 0.93)}),
            "dense");
  EXPECT_EQ(Chosen({Measured("delaunay", 27.3, 0.90), Measured("dense", 27.0, 0.93)}), "delaunay")
      << "0.3 dB are a difference";
  EXPECT_EQ(Chosen({Measured("delaunay", 27.2, 0.93), Measured("dense", 27.0, 0.90)}), "delaunay");
  // Each within the bound of the next: the bound counts from the highest.
  EXPECT_EQ(Chosen({Measured("a", 26.8, 0.95), Measured("b", 27, 0.93), Measured("c", 27.2, 0.90)}), "b");
  EXPECT_EQ(Chosen({Measured("fine", 27, 0.9, 1000), Measured("coarse", 27, 0.9, 10)}), "coarse");
}

TEST(ChooseProxy, WithinTheBudgetOrTheFastest) {
  const std::vector<ProxyCandidate> candidates{Measured("plane", 23, 0.6, 2, 5), Measured("delaunay", 27, 0.9, 100, 10),
                                               Measured("dense", 29, 0.95, 60000, 20)};
  EXPECT_EQ(Chosen(candidates, 20), "dense");
  EXPECT_EQ(Chosen(candidates, 19), "delaunay");
  EXPECT_EQ(Chosen(candidates, 1), "plane");
}

TEST(ChooseProxy, TheObjectsPixelsDecideAloneWhereThereAreSilhouettes) {
  ProxyCandidate hull = Measured("hull", 10, 0.2), plane = Measured("plane", 15, 0.7);
  hull.psnr_object_db = 25;
  plane.psnr_object_db = 24.9;
  EXPECT_EQ(Chosen({plane, hull}), "hull") << "SSIM counts the holes around it";
}

TEST(ChooseProxy, WithoutMeasuresWhatGoesThroughThePoints) {
  ProxyCandidate plane, mesh, refused;
  plane.name = "plane", mesh.name = "delaunay", refused.name = "box";
  refused.refused = "no tube";
  EXPECT_EQ(Chosen({plane, mesh, refused}), "delaunay");
}

}  // namespace
}  // namespace lumi::test
