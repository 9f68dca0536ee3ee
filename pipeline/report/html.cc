#include "pipeline/report/html.h"

#include <fmt/format.h>

#include "scene/plot/plot.h"

namespace lumi {
namespace {

constexpr const char* kStyle = R"css(
:root{color-scheme:light dark;--page:#fbfaf8;--card:#fff;--ink:#1d1f23;--soft:#666b75;--line:#e3e1dc;--accent:#b4552d;--cool:#2f6f9f;--bar:#e9d9cf}
@media(prefers-color-scheme:dark){:root{--page:#15171a;--card:#1d2024;--ink:#e8e6e1;--soft:#9aa0aa;--line:#2e3238;--accent:#e58a5e;--cool:#74b3e0;--bar:#4a3327}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",sans-serif}
main{max-width:1000px;margin:0 auto;padding:3rem 1.25rem 5rem}
h1{font-size:2rem;line-height:1.2;margin:0 0 .25rem;letter-spacing:-.02em}
h2{font-size:1.15rem;margin:3rem 0 .75rem;letter-spacing:-.01em}
p{margin:.5rem 0;max-width:46rem}
.soft,figcaption{color:var(--soft)}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:.75rem;margin:1.75rem 0 0}
.card{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:.9rem 1rem}
.card b{display:block;font-size:1.5rem;font-weight:600;letter-spacing:-.02em;font-variant-numeric:tabular-nums}
.card span{display:block;font-size:.85rem}.card small{color:var(--soft);font-size:.78rem}
.frame{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:.5rem;overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.9rem;font-variant-numeric:tabular-nums}
th{font-weight:500;color:var(--soft);text-align:left;padding:.4rem .7rem;border-bottom:1px solid var(--line);white-space:nowrap}
td{padding:.38rem .7rem;border-bottom:1px solid var(--line);vertical-align:top}
tr:last-child td{border-bottom:0}tr.total td{font-weight:600}
.n{text-align:right;white-space:nowrap}
.bar{display:inline-block;height:.6em;background:var(--accent);border-radius:2px;vertical-align:baseline}
code,pre{font:.88em/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
pre{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:.8rem 1rem;overflow-x:auto;margin:.6rem 0}
.map{width:100%;height:auto;display:block}
.map .points{stroke:var(--soft);stroke-width:1.6;stroke-linecap:round;opacity:.45;fill:none}
.map polygon{stroke-width:1.2;stroke-linejoin:round;fill-opacity:.16}
.camera polygon,.camera circle{stroke:var(--cool);fill:var(--cool)}.held-out polygon,.held-out circle{stroke:var(--accent);fill:var(--accent)}
.sheet{display:grid;grid-template-columns:repeat(3,1fr);gap:.5rem .4rem}
.sheet.photos{grid-template-columns:repeat(auto-fill,minmax(180px,1fr))}
.sheet img{width:100%;height:auto;display:block;border-radius:4px}
.sheet .head{font-size:.8rem;color:var(--soft)}.sheet .name{grid-column:1/-1;font-size:.8rem;color:var(--soft);margin-top:.4rem}
.key{display:inline-block;width:.7em;height:.7em;border-radius:50%;margin:0 .35em 0 .9em}
details{margin:.5rem 0}summary{cursor:pointer;color:var(--soft)}
@media print{body{background:#fff}.card,.frame,pre{break-inside:avoid}}
)css";

std::string Base64(const std::string& bytes) {
  static constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kAlphabet[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace

std::string EscapeHtml(const std::string& text) { return Escaped(text); }

std::string HtmlTable(const std::vector<Column>& columns, const std::vector<std::vector<std::string>>& rows,
                      bool total) {
  std::string html = "<div class=\"frame\"><table><thead><tr>";
  const auto cell_class = [&](std::size_t i) { return i < columns.size() && columns[i].number ? " class=\"n\"" : ""; };
  for (std::size_t i = 0; i < columns.size(); ++i)
    html += fmt::format("<th{}>{}</th>", cell_class(i), columns[i].title);
  html += "</tr></thead><tbody>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    html += total && r + 1 == rows.size() ? "<tr class=\"total\">" : "<tr>";
    for (std::size_t i = 0; i < rows[r].size(); ++i) html += fmt::format("<td{}>{}</td>", cell_class(i), rows[r][i]);
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string HtmlCard(const std::string& value, const std::string& label, const std::string& note) {
  return fmt::format("<div class=\"card\"><b>{}</b><span>{}</span>{}</div>\n", value, label,
                     note.empty() ? "" : "<small>" + note + "</small>");
}

std::string HtmlSection(const std::string& title, const std::string& body) {
  return body.empty() ? std::string() : fmt::format("<section><h2>{}</h2>\n{}</section>\n", title, body);
}

std::string HtmlInlineSvg(const std::string& svg, const std::string& alternative_text) {
  return "<img style=\"width:100%\" alt=\"" + EscapeHtml(alternative_text) + "\" src=\"data:image/svg+xml;base64," +
         Base64(svg) + "\">";
}

std::string HtmlInlineJpeg(const std::string& bytes, const std::string& alternative_text) {
  return fmt::format("<img loading=\"lazy\" alt=\"{}\" src=\"data:image/jpeg;base64,{}\">",
                     EscapeHtml(alternative_text), Base64(bytes));
}

std::string HtmlPage(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\">"
      "<title>{}</title><style>{}</style></head>\n<body><main>\n{}</main></body></html>\n",
      EscapeHtml(title), kStyle, body);
}

}  // namespace lumi
