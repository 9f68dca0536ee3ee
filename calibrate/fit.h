// From corners to a calibration: a start, robustly found outliers, the choice of the lens model by cross-validation,
// and what the data do not allow. No pictures, no files.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/refine.h"

namespace lumi {

struct FitOptions {
  std::string model;              // empty: chosen; else a name of LensModelFromName
  bool fix_aspect = false;        // fy = fx in every model
  bool keep_outliers = false;     // no view and no corner is left out: plain least squares over all
  int folds = 5;                  // of the cross-validation, >= 2
  double min_coverage = 0.3;      // share of the photo that the corners' hull has to cover, 0..1
  double max_focal_sigma = 0.03;  // relative standard deviation of fx beyond which nothing is answered, > 0
  std::string Problem() const;    // what is wrong with the options, or empty
};

struct RefusedView {
  std::string name, reason;
};

struct ModelTrial {
  LensModel model;
  double rms_px = 0;
  std::optional<double> cross_validated_rms_px;  // nothing where a fold could not be fitted, or none were
  std::string why_not;
  double seconds = 0;                 // all its fits
  double fx_px = 0, sigma_fx_px = 0;  // its focal length, and the standard deviation by the corners' noise
  bool as_good = false;               // its cross-validated error is the smallest one's within noise
};

struct FitResult {
  Calibration calibration;                       // of the views below
  std::vector<BoardView> views;                  // used
  std::vector<RefusedView> refused;              // outliers
  std::vector<ModelTrial> trials;                // from few terms to many; one where the model was given
  std::optional<double> cross_validated_rms_px;  // of the chosen model
  std::string choice;                            // why this model, one line
  PixelTerms model_spread_px;                    // what other models that do as well add to the standard deviations
  double coverage = 0;                           // share of the photo that the corners' hull covers
  int corners_left_out = 0;
  // Standard deviations by the corners' noise and by what models that do as well make of them.
  PixelTerms PixelSigmas() const {
    const PixelTerms noise = calibration.PixelSigmas(calibration.noise_px), &models = model_spread_px;
    return {std::hypot(noise.fx, models.fx), std::hypot(noise.fy, models.fy), std::hypot(noise.cx, models.cx),
            std::hypot(noise.cy, models.cy)};
  }
};

// Throws DataError naming what is degenerate: fewer than three views, corners in one part of the photo, boards all
// parallel, mirrored ...
FitResult Fit(const Board& board, std::vector<BoardView> views, int width_px, int height_px, const FitOptions& options);

// Area of the convex hull of all corners over that of the photo.
double Coverage(const std::vector<BoardView>& views, int width_px, int height_px);

// Held-out reprojection: `views` that the intrinsics were not fitted to, poses re-estimated; squared distances summed
// for each view.
std::vector<double> HeldOutSquares(const Board& board, const std::vector<BoardView>& views,
                                   const Intrinsics& intrinsics, const std::vector<Rigid3>& start);

struct ViewCountTrial {
  int views = 0;
  double held_out_rms_px = 0;   // on the views left out; of all views: the cross-validated error
  double sigma_f_percent = 0;   // reported standard deviation of fx
  double spread_f_percent = 0;  // standard deviation of fx over the subsets, 0 for the whole set
  double seconds = 0;           // of a fit
  int subsets = 0;
};
// Accuracy against the number of views, with the model that was chosen: random subsets of each size.
std::vector<ViewCountTrial> ViewCountTradeoff(const Board& board, const FitResult& fit, std::uint64_t seed);

}  // namespace lumi
