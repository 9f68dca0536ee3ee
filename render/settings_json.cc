#include "render/settings_json.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

std::string Text(const Json& v) { return v.is_string() ? v.get<std::string>() : v.dump(); }

double Number(const std::string& name, const Json& v) {
  try {
    if (v.is_number()) return v.get<double>();
    const std::string text = Text(v);
    std::size_t used = 0;
    const double d = std::stod(text, &used);
    if (used != text.size() || !std::isfinite(d)) throw std::invalid_argument(text);
    return d;
  } catch (const std::exception&) {
    throw UsageError(fmt::format("--{} takes a number, not {}", name, Text(v)));
  }
}

int Whole(const std::string& name, const std::string& text, const std::string& takes) {
  try {
    std::size_t used = 0;
    const int i = std::stoi(text, &used);
    if (used != text.size()) throw std::invalid_argument(text);
    return i;
  } catch (const std::exception&) {
    throw UsageError(fmt::format("--{} takes {}, not {}", name, takes, text));
  }
}

bool Switch(const std::string& name, const Json& v) {
  if (v.is_boolean()) return v.get<bool>();
  const std::string text = Text(v);
  if (text == "on" || text == "true") return true;
  if (text == "off" || text == "false") return false;
  throw UsageError(fmt::format("--{} takes on or off, not {}", name, text));
}

// A degree's rounding must not show in a summary: 20 and not 20.000000000000004.
double Degrees(double rad) { return std::round(rad / kRadiansPerDegree * 1e12) / 1e12; }

using S = RadianceSettings;
struct Entry {
  SettingOption option;
  std::function<Json(const S&)> get;
  std::function<void(S&, const Json&)> set;
};

Entry Real(const std::string& name, const std::string& help, double S::* field) {
  return {{name, "FLOAT", help, {}}, [=](const S& s) { return Json(s.*field); }, [=](S& s, const Json& v) { s.*field = Number(name, v); }};
}
Entry Angle(const std::string& name, const std::string& help, double S::* field) {
  return {{name, "FLOAT", help, {}},
          [=](const S& s) { return Json(Degrees(s.*field)); },
          [=](S& s, const Json& v) { s.*field = Number(name, v) * kRadiansPerDegree; }};
}
Entry Flag(const std::string& name, const std::string& help, bool S::* field) {
  return {{name, "on|off", help, {}}, [=](const S& s) { return Json(s.*field ? "on" : "off"); }, [=](S& s, const Json& v) { s.*field = Switch(name, v); }};
}
template <typename E>
Entry Choice(const std::string& name, const std::string& help, E S::* field, std::initializer_list<E> values) {
  const std::vector<E> kept(values);
  std::vector<std::string_view> names;
  for (const E e : values) names.push_back(Name(e));
  const std::string all = fmt::format("{}", fmt::join(names, "|"));
  return {{name, all, help, {}},
          [=](const S& s) { return Json(Name(s.*field)); },
          [=](S& s, const Json& v) {
            for (const E e : kept)
              if (Text(v) == Name(e)) {
                s.*field = e;
                return;
              }
            throw UsageError(fmt::format("--{} takes {}; not {}", name, all, Text(v)));
          }};
}

const std::vector<Entry>& Entries() {
  static const std::vector<Entry> entries = [] {
    std::vector<Entry> e;
    e.push_back(Choice("similarity", "Photos weigh each on its own (identity), or as the best linear estimate (full)", &S::similarity,
                       {Similarity::kIdentity, Similarity::kFull}));
    e.push_back({{"k", "1..16|all", "Photos blended at a ray", {}},
                 [](const S& s) { return s.k == 0 ? Json("all") : Json(s.k); },
                 [](S& s, const Json& v) {
                   if (Text(v) == "all") {
                     s.k = 0;
                     return;
                   }
                   s.k = Whole("k", Text(v), fmt::format("1 to {}, or all", kMaxBlend));
                   if (s.k < 1 || s.k > kMaxBlend) throw UsageError(fmt::format("--k takes 1 to {}, or all; not {}", kMaxBlend, Text(v)));
                 }});
    e.push_back(Choice("correlation", "R(h): 1/h, or the falling-leaves image model's", &S::correlation,
                       {Correlation::kInverse, Correlation::kFallingLeaves}));
    e.push_back({{"grid", "WxH|pixel", "Sparse samples of the view, 2 to 4096 a side, or every pixel", {}},
                 [](const S& s) { return s.Sparse() ? Json(fmt::format("{}x{}", s.grid_columns, s.grid_rows)) : Json("pixel"); },
                 [](S& s, const Json& v) {
                   const std::string text = Text(v), takes = "WxH with 2 to 4096 samples a side, or pixel";
                   if (text == "pixel") {
                     s.grid_columns = s.grid_rows = 0;
                     return;
                   }
                   const std::size_t x = text.find('x');
                   if (x == std::string::npos) throw UsageError(fmt::format("--grid takes {}; not {}", takes, text));
                   s.grid_columns = Whole("grid", text.substr(0, x), takes);
                   s.grid_rows = Whole("grid", text.substr(x + 1), takes);
                   if (std::min(s.grid_columns, s.grid_rows) < 2 || std::max(s.grid_columns, s.grid_rows) > 4096)
                     throw UsageError(fmt::format("--grid takes {}; not {}", takes, text));
                 }});
    e.push_back(Choice("sampling", "What a sparse sample gives its pixels: its photos (candidates) or their weights (interpolated)", &S::sampling,
                       {Sampling::kCandidates, Sampling::kInterpolated}));
    e.push_back(Flag("epipoles", "Sparse samples also where the view sees a photo's centre", &S::epipoles));
    e.push_back(Choice("sum", "How the optimum's weights come to sum to 1", &S::sum, {WeightSum::kRenormalise, WeightSum::kConstrained, WeightSum::kLocalMean}));
    e.push_back(Choice("combine", "How field of view and visibility enter the optimum", &S::combine, {Combine::kSmooth, Combine::kAdditive}));
    e.push_back(Angle("cutoff-deg", "The optimum leaves out photos farther from the ray, degrees, (0, 180]", &S::cutoff_rad));
    e.push_back(Real("accuracy", "Largest error of the optimum's weights, > 0; below 1e-4 in double precision", &S::accuracy));
    e.push_back(Angle("r-min-deg", "Smallest leaf, degrees, [0, r-max]", &S::r_min_rad));
    e.push_back(Angle("r-max-deg", "Largest leaf, degrees, (0, 90]; the unit of resolution and time penalties is twice this", &S::r_max_rad));
    e.push_back(Real("alpha", "Weight of the angle, >= 0", &S::alpha));
    e.push_back(Real("beta", "Weight of the resolution measure, >= 0", &S::beta));
    e.push_back(Real("gamma", "Weight of the field-of-view and visibility penalty, >= 0", &S::gamma));
    e.push_back(Real("epsilon", "Weight of the time measure, >= 0", &S::epsilon));
    e.push_back(Choice("resolution", "Measure of how a photo's pixels are stretched", &S::resolution,
                       {Resolution::kOff, Resolution::kDistance, Resolution::kJacobian}));
    e.push_back({{"resolution-range", "LOW,HIGH", "Stretches at which a photo's resolution counts least, [0, 1) and above 1; LOW 0: oversampled photos are as good", {}},
                 [](const S& s) { return Json(fmt::format("{:g},{:g}", s.resolution_low, s.resolution_high)); },
                 [](S& s, const Json& v) {
                   const std::string text = Text(v);
                   const std::size_t comma = text.find(',');
                   if (comma == std::string::npos) throw UsageError("--resolution-range takes LOW,HIGH, not " + text);
                   s.resolution_low = Number("resolution-range", Json(text.substr(0, comma)));
                   s.resolution_high = Number("resolution-range", Json(text.substr(comma + 1)));
                 }});
    e.push_back(Flag("fov", "Field of view: a photo fades towards its border, and others fill in", &S::field_of_view));
    e.push_back(Real("fov-feather", "Border over which a photo fades, fraction of its smaller side, (0, 0.5]", &S::fov_feather));
    e.push_back(Flag("visibility", "Photos whose view of a point the proxy blocks rank last", &S::visibility));
    e.push_back(Flag("time", "Photos away from the view's time rank behind", &S::time));
    e.push_back(Real("time-s", "The view's time, seconds", &S::time_s));
    e.push_back(Real("time-window-s", "Window around it, seconds, > 0", &S::time_window_s));
    e.push_back(Real("time-core", "Part of the window in which time counts least, [0, 0.95]", &S::time_core));
    e.push_back(Real("time-least", "How much it counts there, of what it counts at the window's edge, [0, 0.5]", &S::time_least));
    e.push_back(Flag("exposure", "Photos are brought to one exposure", &S::exposure));
    e.push_back(Flag("prefilter", "Oversampled photos are read from their pyramid", &S::prefilter));
    const S defaults;
    for (Entry& entry : e) entry.option.fallback = Text(entry.get(defaults));
    return e;
  }();
  return entries;
}

}  // namespace

Json ToJson(const RadianceSettings& settings) {
  Json j = Json::object();
  for (const Entry& e : Entries()) j[e.option.name] = e.get(settings);
  return j;
}

bool SetOption(RadianceSettings& settings, const std::string& name, const Json& value) {
  for (const Entry& e : Entries())
    if (e.option.name == name) {
      e.set(settings, value);
      return true;
    }
  return false;
}

const std::vector<SettingOption>& SettingOptions() {
  static const std::vector<SettingOption> options = [] {
    std::vector<SettingOption> o;
    for (const Entry& e : Entries()) o.push_back(e.option);
    return o;
  }();
  return options;
}

}  // namespace lumi
