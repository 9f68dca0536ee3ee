// Which of the reconstruction's options say anything under the others, and how a change of one carries others along, so
// that a panel never builds a combination that Validate refuses.
#pragma once

#include <string>
#include <string_view>

#include "render/radiance/settings.h"

namespace lumi {

// Empty where the option (a name of setting_options.h) has an effect; else why it has none, a line for a tooltip.
std::string WhyWithoutEffect(const RadianceSettings& settings, std::string_view option);

// After `option` was changed by the user: what else has to follow. The optimum needs falling leaves, and on a grid
// interpolated weights; whoever takes those away leaves the optimum.
void Reconcile(RadianceSettings& settings, std::string_view option);

// One line for people: what distinguishes these settings, as "k 4, candidates 25x25, fov, visibility".
std::string Describe(const RadianceSettings& settings);

}  // namespace lumi
