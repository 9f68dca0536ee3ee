// Holes filled on the graphics processor: what the CPU's FillSmoothly makes of the same picture.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <random>

#include "render/gl/hole_fill.h"
#include "render/picture/border_fill.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

// Half floats between the levels: an eleventh bit, once a level down and up; under one code value of 8 bits.
constexpr float kFillTolerance = 3e-3F;

class GlHoleFilling : public test::GlTest {
 protected:
  // The picture in a corner of a texture that may be larger, as a preview's is.
  ImageF Filled(const ImageF& picture, const Eigen::Vector2i& capacity_px) {
    const GlTexture texture = MakePictureTexture(GL_RGBA32F, capacity_px.x(), capacity_px.y());
    const std::vector<float> rubbish(4 * static_cast<std::size_t>(capacity_px.prod()), 0.77F);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, capacity_px.x(), capacity_px.y(), GL_RGBA, GL_FLOAT, rubbish.data());
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, picture.width, picture.height, GL_RGBA, GL_FLOAT, picture.data.data());
    fill_.Fill(texture.id(), {picture.width, picture.height});
    EXPECT_EQ(fill_.size_px(), Eigen::Vector2i(picture.width, picture.height));
    const GlFramebuffer framebuffer = GlFramebuffer::Make();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, fill_.texture(), 0);
    ImageF out(picture.width, picture.height, 4);
    glReadPixels(0, 0, picture.width, picture.height, GL_RGBA, GL_FLOAT, out.data.data());
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    CheckGl("reading a filled picture");
    return out;
  }
  ImageF Filled(const ImageF& picture) { return Filled(picture, {picture.width, picture.height}); }
  void TearDown() override {
    fill_ = {};
    test::GlTest::TearDown();
  }

  GlHoleFill fill_;
};

// Opaque and half-transparent patches of random colours; the rest is a hole.
ImageF PatchesAndHoles(int width, int height, int patches, unsigned seed) {
  std::mt19937 random(seed);
  const auto unit = [&] { return static_cast<float>(random() % 1024) / 1023.0F; };
  ImageF image(width, height, 4);
  for (int p = 0; p < patches; ++p) {
    const int x0 = static_cast<int>(random() % static_cast<unsigned>(width)),
              y0 = static_cast<int>(random() % static_cast<unsigned>(height));
    const float alpha = p % 3 == 0 ? 0.1F + 0.8F * unit() : 1.0F;
    const float rgb[3] = {unit(), unit(), unit()};
    for (int y = y0; y < std::min(height, y0 + 1 + height / 5); ++y)
      for (int x = x0; x < std::min(width, x0 + 1 + width / 6); ++x) {
        for (int c = 0; c < 3; ++c) image.At(x, y, c) = alpha * rgb[c];
        image.At(x, y, 3) = alpha;
      }
  }
  return image;
}

TEST_F(GlHoleFilling, IsWhatTheCpuFills) {
  unsigned seed = 1;
  for (const Eigen::Vector2i& size : {Eigen::Vector2i(37, 23), Eigen::Vector2i(256, 128), Eigen::Vector2i(131, 200),
                                      Eigen::Vector2i(2, 2), Eigen::Vector2i(1, 9), Eigen::Vector2i(65, 3)})
    for (const int patches : {1, 4, 12}) {
      const ImageF picture = PatchesAndHoles(size.x(), size.y(), patches, seed++);
      ImageF wanted = picture;
      FillSmoothly(wanted);
      for (const int margin : {0, 13}) {
        const ImageF filled = Filled(picture, size.array() + margin);
        for (int y = 0; y < size.y(); ++y)
          for (int x = 0; x < size.x(); ++x)
            for (int c = 0; c < 4; ++c) {
              ASSERT_NEAR(filled.At(x, y, c), wanted.At(x, y, c), kFillTolerance)
                  << size.transpose() << ", " << patches << " patches: " << x << ' ' << y << ' ' << c;
              const bool seen = picture.At(x, y, 3) == 1.0F;
              ASSERT_TRUE(!seen || filled.At(x, y, c) == picture.At(x, y, c)) << "to the last bit";
            }
      }
    }
}

TEST_F(GlHoleFilling, IsConstantAroundAConstantAndLeavesAnEmptyPictureEmpty) {
  ImageF one(90, 70, 4);
  for (int c = 0; c < 4; ++c) one.At(61, 5, c) = c == 3 ? 0.01F : 0.0025F * static_cast<float>(c + 1);
  const ImageF filled = Filled(one);
  for (int y = 0; y < 70; ++y)
    for (int x = 0; x < 90; ++x)
      for (int c = 0; c < 4; ++c)
        ASSERT_NEAR(filled.At(x, y, c), c == 3 ? 1.0F : 0.25F * static_cast<float>(c + 1), kFillTolerance);
  // Smaller than the one before: interpolating in floats may touch what is beside it.
  for (const float v : Filled(ImageF(31, 17, 4)).data) ASSERT_NEAR(v, 0, 1e-5F);
  ImageF opaque(40, 30, 4, 1.0F);
  for (std::size_t i = 0; i < opaque.data.size(); ++i)
    if (i % 4 < 3) opaque.data[i] = static_cast<float>(i % 97) / 96.0F;
  EXPECT_EQ(Filled(opaque).data, opaque.data) << "without a hole nothing changes";
}

}  // namespace
}  // namespace lumi
