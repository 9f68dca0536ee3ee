// Text of other people's making (names of files, what other programs say) as one line that a terminal shows as it is.
#pragma once

#include <string>
#include <string_view>

namespace lumi {

// The bytes of the character that begins at `at`: 1 to 4, or 0 where they are no UTF-8.
std::size_t Utf8Length(std::string_view text, std::size_t at);
bool IsUtf8(std::string_view text);

// A line break becomes \n, another control character or a byte that is no UTF-8 \xHH; the rest stays.
std::string Printable(std::string_view text);

}  // namespace lumi
