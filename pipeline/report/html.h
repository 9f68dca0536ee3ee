// The report's page: its frame, its style and the few elements it is made of.
#pragma once

#include <string>
#include <vector>

namespace lumi {

std::string EscapeHtml(const std::string& text);

// A column's cells; numbers are aligned to the right.
struct Column {
  std::string title;
  bool number = false;
};
// Cells are HTML already. The last row is set apart where `total`.
std::string HtmlTable(const std::vector<Column>& columns, const std::vector<std::vector<std::string>>& rows,
                      bool total = false);

// A figure with its unit and what it means.
std::string HtmlCard(const std::string& value, const std::string& label, const std::string& note = {});

std::string HtmlSection(const std::string& title, const std::string& body);

// A JPEG file as an <img> that carries its bytes.
std::string HtmlInlineJpeg(const std::string& bytes, const std::string& alternative_text);

// An SVG file likewise, apart from the page: its style is its own.
std::string HtmlInlineSvg(const std::string& svg, const std::string& alternative_text);

std::string HtmlPage(const std::string& title, const std::string& body);

}  // namespace lumi
