// Which of the reconstruction's options have an effect given the others, and which others must change with one, so that
// a panel never makes a combination that Validate refuses.
#pragma once

#include <string>
#include <string_view>

#include "render/radiance/settings.h"

namespace lumi {

// Empty where the option (a name of setting_options.h) has an effect; else why it has none, a line for a tooltip.
std::string WhyWithoutEffect(const RadianceSettings& settings, std::string_view option);

// Adapts other settings after the user changed `option`. The optimum needs falling leaves and, on a grid, interpolated
// weights; choosing anything else switches the optimum off.
void Reconcile(RadianceSettings& settings, std::string_view option);

// One line for people: what distinguishes these settings, as "k 4, candidates 25x25, fov, visibility".
std::string Describe(const RadianceSettings& settings);

}  // namespace lumi
