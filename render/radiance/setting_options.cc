#include "render/radiance/setting_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "scene/program/error.h"

namespace lumi {
namespace {

using S = RadianceSettings;

double Number(std::string_view name, const OptionValue& v) {
  if (const auto* d = std::get_if<double>(&v)) return *d;
  const std::string text = Text(v);
  try {
    std::size_t used = 0;
    const double d = std::stod(text, &used);
    if (used == text.size() && std::isfinite(d)) return d;
  } catch (const std::exception&) {  // below
  }
  throw UsageError(fmt::format("--{} takes a number, not {}", name, text));
}

int Whole(std::string_view name, const std::string& text, std::string_view takes) {
  try {
    std::size_t used = 0;
    const int i = std::stoi(text, &used);
    if (used == text.size()) return i;
  } catch (const std::exception&) {  // below
  }
  throw UsageError(fmt::format("--{} takes {}, not {}", name, takes, text));
}

bool OnOff(std::string_view name, const OptionValue& v) {
  if (const auto* b = std::get_if<bool>(&v)) return *b;
  const std::string text = Text(v);
  if (text == "on" || text == "true") return true;
  if (text == "off" || text == "false") return false;
  throw UsageError(fmt::format("--{} takes on or off, not {}", name, text));
}

// Rounds so that a summary shows 20 and not 20.000000000000004.
double Degrees(double rad) { return std::round(rad / kRadPerDeg * 1e12) / 1e12; }

// The table that measures' records and the core add options to; fields of a measure's Settings are fields of
// RadianceSettings.
class Table {
 public:
  explicit Table(std::vector<SettingOption>& options) : options_(options) {}
  std::string_view measure, title;

  template <typename Base>
  void Real(std::string_view name, double Base::*field, Range range, std::string_view help, PanelRow row = {}) {
    Number(name, static_cast<double S::*>(field), range, 1, help, row);
  }
  // Degrees outside, radians inside.
  template <typename Base>
  void Angle(std::string_view name, double Base::*field, Range range_deg, std::string_view help, PanelRow row = {}) {
    Number(name, static_cast<double S::*>(field), range_deg, kRadPerDeg, help, row);
  }
  template <typename Base>
  void Switch(std::string_view name, bool Base::*field, std::string_view help, const char* label = nullptr) {
    bool S::*const at = field;
    SettingOption& o = Add(name, "on|off", help, {label});
    o.is_switch = name == measure;
    o.field = at;
    o.get = [=](const S& s) { return OptionValue(s.*at); };
    o.set = [=](S& s, const OptionValue& v) { s.*at = OnOff(name, v); };
  }
  template <typename Base, typename E>
  void Choice(std::string_view name, E Base::*field, std::initializer_list<E> values, std::string_view help,
              const char* label = nullptr) {
    Choice(name, field, std::span<const E>(values.begin(), values.size()), help, label);
  }
  template <typename Base, typename E>
  void Choice(std::string_view name, E Base::*field, std::span<const E> values, std::string_view help,
              const char* label = nullptr) {
    E S::*const at = field;
    const std::vector<E> kept(values.begin(), values.end());
    std::vector<std::string> names;
    for (const E e : values) names.emplace_back(Name(e));
    const std::string all = fmt::format("{}", fmt::join(names, "|"));
    SettingOption& o = Add(name, all, help, {label});
    o.is_switch = name == measure;
    o.choices = names;
    o.get = [=](const S& s) { return OptionValue(std::string(Name(s.*at))); };
    o.set = [=](S& s, const OptionValue& v) {
      std::string text = Text(v);
      if (text == "false") text = "off";  // JSON's
      const auto found = std::find_if(kept.begin(), kept.end(), [&](E e) { return text == Name(e); });
      if (found == kept.end()) throw UsageError(fmt::format("--{} takes {}; not {}", name, all, text));
      s.*at = *found;
    };
  }
  // Two numbers with a comma between them.
  template <typename Base>
  void Pair(std::string_view name, std::string_view takes, double Base::*first, Range first_range, double Base::*second,
            Range second_range, std::string_view help, PanelRow row = {}) {
    double S::*const a = first;
    double S::*const b = second;
    SettingOption& o = Add(name, std::string(takes), help, row);
    o.get = [=](const S& s) { return OptionValue(fmt::format("{:g},{:g}", s.*a, s.*b)); };
    o.set = [=](S& s, const OptionValue& v) {
      const std::string text = Text(v);
      const std::size_t comma = text.find(',');
      if (comma == std::string::npos) throw UsageError(fmt::format("--{} takes {}, not {}", name, takes, text));
      s.*a = lumi::Number(name, text.substr(0, comma));
      s.*b = lumi::Number(name, text.substr(comma + 1));
    };
    o.problem = [=](const S& s) {
      if (!first_range.Holds(s.*a)) return fmt::format("--{} must begin in {}", name, first_range.Text().substr(7));
      if (!second_range.Holds(s.*b)) return fmt::format("--{} must end above {:g}", name, second_range.low);
      return std::string();
    };
  }
  template <typename Get, typename Set>
  void Custom(std::string_view name, std::string_view takes, std::string_view help, Get get, Set set) {
    SettingOption& o = Add(name, std::string(takes), help, {});
    o.get = [=](const S& s) { return OptionValue(get(s)); };
    o.set = [=](S& s, const OptionValue& v) { set(s, Text(v)); };
  }

 private:
  SettingOption& Add(std::string_view name, std::string takes, std::string_view help, PanelRow row) {
    SettingOption& o = options_.emplace_back();
    o.name = name;
    o.value = std::move(takes);
    o.help = help;
    o.measure = measure;
    o.measure_title = title;
    o.row = row;
    return o;
  }
  void Number(std::string_view name, double S::*at, Range range, double unit, std::string_view help, PanelRow row) {
    SettingOption& o = Add(name, "FLOAT", help, row);
    o.field = at;
    o.unit = unit;
    o.get = [=](const S& s) { return OptionValue(unit == 1 ? s.*at : Degrees(s.*at)); };
    o.set = [=](S& s, const OptionValue& v) { s.*at = lumi::Number(name, v) * unit; };
    o.problem = [=](const S& s) {
      return range.Holds(unit == 1 ? s.*at : Degrees(s.*at)) ? std::string()
                                                             : fmt::format("--{} must {}", name, range.Text());
    };
  }
  std::vector<SettingOption>& options_;
};

void AddK(Table& t) {
  t.Custom(
      "k", "1..16|all", "Photos blended at a ray", [](const S& s) { return s.k == 0 ? "all" : std::to_string(s.k); },
      [](S& s, const std::string& text) {
        const std::string takes = fmt::format("1 to {}, or all", kMaxBlend);
        const int k = text == "all" ? 0 : Whole("k", text, takes);
        if (text != "all" && (k < 1 || k > kMaxBlend))
          throw UsageError(fmt::format("--k takes {}; not {}", takes, text));
        s.k = k;
      });
}

void AddGrid(Table& t) {
  t.Custom(
      "grid", "WxH|pixel", "Sparse samples of the view, 2 to 4096 a side, or every pixel",
      [](const S& s) { return s.Sparse() ? fmt::format("{}x{}", s.grid_columns, s.grid_rows) : std::string("pixel"); },
      [](S& s, const std::string& text) {
        const std::string_view takes = "WxH with 2 to 4096 samples a side, or pixel";
        if (text == "pixel") {
          s.grid_columns = s.grid_rows = 0;
          return;
        }
        const std::size_t x = text.find('x');
        if (x == std::string::npos) throw UsageError(fmt::format("--grid takes {}; not {}", takes, text));
        const int columns = Whole("grid", text.substr(0, x), takes), rows = Whole("grid", text.substr(x + 1), takes);
        if (std::min(columns, rows) < 2 || std::max(columns, rows) > 4096)
          throw UsageError(fmt::format("--grid takes {}; not {}", takes, text));
        s.grid_columns = columns;
        s.grid_rows = rows;
      });
}

std::vector<SettingOption> MakeOptions() {
  std::vector<SettingOption> options;
  Table t(options);
  t.Choice("similarity", &S::similarity, {Similarity::kIdentity, Similarity::kFull},
           "Photos weigh each on its own (identity), or as the best linear estimate (full)", "similarity");
  AddK(t);
  t.Choice("correlation", &S::correlation, {Correlation::kInverse, Correlation::kFallingLeaves, Correlation::kMeasured},
           "R(h): 1/h, the falling-leaves image model's, or that of the leaves that fit these photos over this proxy",
           "correlation");
  AddGrid(t);
  t.Choice("sampling", &S::sampling, {Sampling::kCandidates, Sampling::kInterpolated},
           "What a sparse sample gives its pixels: its photos (candidates) or their weights (interpolated)",
           "sampling");
  t.Switch("epipoles", &S::epipoles, "Sparse samples also where the view sees a photo's centre",
           "samples at the photos' centres");
  t.Choice("sum", &S::sum, {WeightSum::kRenormalise, WeightSum::kConstrained, WeightSum::kLocalMean},
           "How the optimum's weights come to sum to 1", "sum");
  t.Choice("combine", &S::combine, {Combine::kSmooth, Combine::kAdditive},
           "How field of view and visibility enter the optimum", "combine");
  t.Angle("cutoff-deg", &S::cutoff_rad, {0, 180, true},
          "The optimum leaves out photos farther from the ray, degrees, (0, 180]", {"cutoff", 1, 180, "%.0f deg"});
  t.Real("accuracy", &S::accuracy, {0, kAnyNumber.high, true},
         "Largest error of the optimum's weights, > 0; below 1e-4 in double precision");
  t.Angle("r-min-deg", &S::r_min_rad, {0, 90}, "Smallest leaf, degrees, [0, r-max]",
          {"smallest leaf", 0, 10, "%.3f deg"});
  t.Angle("r-max-deg", &S::r_max_rad, {0, 90, true},
          "Largest leaf, degrees, (0, 90]; the unit of resolution and time penalties is twice this",
          {"largest leaf", 0.01, 90, "%.2f deg"});
  t.Choice("method", &S::method, Algorithms(),
           "Whose weights: this renderer's (ulr), or a published method's, to compare with (docs/methods.md)",
           "method");
  t.Real("method-count", &S::method_count, kAnyNumber,
         "How many photos, grid points or parts of a side a published method takes; below 0: as published");
  t.Real("method-parameter", &S::method_parameter, kAnyNumber,
         "Exponent, share or smoothness of a published method; below 0: as published");
  t.Real(
      "noise", &S::noise, {0, 100},
      "What each photo has of its own, over what correlates with others (variances), 0 to 100: the optimum averages it",
      {"noise", 0, 10, "%.2f"});
  t.Custom(
      "correlation-regions", "N",
      "With --correlation measured: places along the scene's longest side that have leaves of their own, 1 to 32; 1: "
      "one kind everywhere",
      [](const S& s) { return std::to_string(s.correlation_regions); },
      [](S& s, const std::string& text) {
        constexpr std::string_view takes = "1 to 32";
        s.correlation_regions = Whole("correlation-regions", text, takes);
        if (s.correlation_regions < 1 || s.correlation_regions > 32)
          throw UsageError(fmt::format("--correlation-regions takes {}, not {}", takes, text));
      });
  MeasureList::ForEach([&]<typename M> {
    t.measure = M::kName;
    t.title = M::kTitle;
    M::Options(t);
  });
  const S defaults;
  for (SettingOption& o : options) o.fallback = Text(o.get(defaults));
  return options;
}

}  // namespace

std::string Text(const OptionValue& value) {
  if (const auto* b = std::get_if<bool>(&value)) return *b ? "on" : "off";
  if (const auto* d = std::get_if<double>(&value)) {
    const std::string text = fmt::format("{}", *d);
    return text.find_first_not_of("-0123456789") == std::string::npos ? text + ".0" : text;  // as JSON has it
  }
  return std::get<std::string>(value);
}

const std::vector<SettingOption>& SettingOptions() {
  static const std::vector<SettingOption> options = MakeOptions();
  return options;
}

const SettingOption* FindSettingOption(std::string_view name) {
  const auto& all = SettingOptions();
  const auto found = std::find_if(all.begin(), all.end(), [&](const SettingOption& o) { return o.name == name; });
  return found == all.end() ? nullptr : &*found;
}

bool SetOption(RadianceSettings& settings, const std::string& name, const std::string& text) {
  const SettingOption* option = FindSettingOption(name);
  if (option) option->set(settings, text);
  return option != nullptr;
}

bool IsOn(const RadianceSettings& settings, std::string_view measure) {
  bool on = true;
  ForEachEffect([&]<typename M> {
    if (M::kName == measure) on = M::On(settings);
  });
  return on;
}

}  // namespace lumi
