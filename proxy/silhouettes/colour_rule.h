// A rule on colours that says which pixels are the object: "(B - R) < 25 && R + G + B > 60".
//
//   R G B      the photo's own code values, 0..255        H S V    hue 0..360 degrees, saturation and value 0..1
//   L          0.299 R + 0.587 G + 0.114 B                X Y      the pixel's centre, in pixels from the upper left
//   corner numbers, + - * / ( ), < <= > >= == !=, && || ! (also: and or not), min(a, b) max(a, b) abs(a)
//
// Truth is 1 and 0; a pixel is the object where the rule is not 0. A division by zero makes a comparison false.
#pragma once

#include <string>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

class ColourRule {
 public:
  // Throws UsageError, naming the place that is not understood.
  explicit ColourRule(const std::string& text);
  double Evaluate(const double rgb[3], double x_px, double y_px) const;

  // op: a variable's letter as above, or the operator, of two characters by its first but for these.
  static constexpr char kNumber = '0', kNegate = '~', kLessEqual = '[', kGreaterEqual = ']', kUnequal = '#', kMin = 'm',
                        kMax = 'M', kAbs = 'a';
  struct Step {
    char op;
    double number = 0;
  };

 private:
  std::vector<Step> steps_;  // in reverse Polish order
};

// photo: RGB or RGBA.
Image8 SilhouetteFromRule(const Image8& photo, const ColourRule& rule);

}  // namespace lumi
