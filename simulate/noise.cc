#include "simulate/noise.h"

#include <algorithm>

namespace lumi {
namespace {

// std::floor is a call into the library on processors as old as the ones we build for.
std::int32_t FloorToInt(float x) {
  const auto i = static_cast<std::int32_t>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

float Fade(float t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }
float Mix(float a, float b, float t) { return a + t * (b - a); }

}  // namespace

float GradientNoise(const Eigen::Vector3f& x, std::uint32_t seed) {
  const std::int32_t lx = FloorToInt(x.x()), ly = FloorToInt(x.y()), lz = FloorToInt(x.z());
  const float dx = x.x() - static_cast<float>(lx), dy = x.y() - static_cast<float>(ly),
              dz = x.z() - static_cast<float>(lz);
  // Cheaper than HashBits: a gradient needs a few good bits, not thirty-two.
  const std::uint32_t hx = static_cast<std::uint32_t>(lx) + seed * 0x9e3779b9U;
  const std::uint32_t x0 = hx * 0x8da6b343U, x1 = x0 + 0x8da6b343U;
  const std::uint32_t y0 = static_cast<std::uint32_t>(ly) * 0xd8163841U, y1 = y0 + 0xd8163841U;
  const std::uint32_t z0 = static_cast<std::uint32_t>(lz) * 0xcb1ab31fU, z1 = z0 + 0xcb1ab31fU;
  // The eight corners side by side, written so that the compiler takes them four at a time.
  std::uint32_t hash[8] = {x0 ^ y0 ^ z0, x1 ^ y0 ^ z0, x0 ^ y1 ^ z0, x1 ^ y1 ^ z0,
                           x0 ^ y0 ^ z1, x1 ^ y0 ^ z1, x0 ^ y1 ^ z1, x1 ^ y1 ^ z1};
  const float cx[8] = {dx, dx - 1, dx, dx - 1, dx, dx - 1, dx, dx - 1};
  const float cy[8] = {dy, dy, dy - 1, dy - 1, dy, dy, dy - 1, dy - 1};
  const float cz[8] = {dz, dz, dz, dz, dz - 1, dz - 1, dz - 1, dz - 1};
  float dot[8];
  for (int k = 0; k < 8; ++k) {
    std::uint32_t h = hash[k];
    h ^= h >> 15;
    h *= 0x2c1b3c6dU;
    // Three components of -1 to 1 in steps of 2 / 1023 (gradients of about unit length on average).
    const auto gx = static_cast<float>(static_cast<std::int32_t>((h >> 2) & 1023U) * 2 - 1023);
    const auto gy = static_cast<float>(static_cast<std::int32_t>((h >> 12) & 1023U) * 2 - 1023);
    const auto gz = static_cast<float>(static_cast<std::int32_t>((h >> 22) & 1023U) * 2 - 1023);
    dot[k] = (gx * cx[k] + gy * cy[k] + gz * cz[k]) * (1.45f / 1023.0f);
  }
  const float u = Fade(dx), v = Fade(dy), w = Fade(dz);
  return Mix(Mix(Mix(dot[0], dot[1], u), Mix(dot[2], dot[3], u), v),
             Mix(Mix(dot[4], dot[5], u), Mix(dot[6], dot[7], u), v), w);
}

float FractalNoise(const Eigen::Vector3f& x, int octaves, float gain, float footprint, std::uint32_t seed) {
  float sum = 0, strength = 1, frequency = 1;
  for (int octave = 0; octave < octaves; ++octave) {
    // Fades out as the feature shrinks from two footprints to one.
    const float visible = std::clamp(1.0f / std::max(frequency * footprint, 1e-6f) - 1.0f, 0.0f, 1.0f);
    if (visible <= 0) break;
    sum += visible * strength * GradientNoise(x * frequency, seed + static_cast<std::uint32_t>(octave));
    strength *= gain;
    frequency *= 2.03f;  // not 2: lattice points of the octaves must not coincide
  }
  return sum;
}

}  // namespace lumi
