// SPDX-License-Identifier: Apache-2.0
#include "document.hpp"

#include <cmath>
#include <limits>

#include <toml++/toml.h>
#include <nlohmann/json.hpp>

#include "file.hpp"
#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string_view kind_name(Node::Kind kind) {
  switch (kind) {
    case Node::Kind::kBoolean:
      return "a boolean";
    case Node::Kind::kNumber:
      return "a number";
    case Node::Kind::kText:
      return "text";
    case Node::Kind::kArray:
      return "an array";
    case Node::Kind::kTable:
      return "a table";
    case Node::Kind::kNull:
      break;
  }
  return "null";
}

/// JSON has no infinity; programs write the bare words Infinity and NaN all the same. They are turned into
/// text outside strings, and Node::number_or_infinity reads that text.
std::string quote_bare_words(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      out += c;
      if (c == '\\' && i + 1 < text.size()) {
        out += text[++i];
      } else if (c == '"') {
        in_string = false;
      }
      continue;
    }
    bool replaced = false;
    for (const std::string_view word : {"-Infinity", "Infinity", "NaN"}) {
      if (text.substr(i, word.size()) == word) {
        out += '"' + std::string(word) + '"';
        i += word.size() - 1;
        replaced = true;
        break;
      }
    }
    if (!replaced) {
      in_string = c == '"';
      out += c;
    }
  }
  return out;
}

std::optional<double> special_number(std::string_view text) {
  if (text == "inf" || text == "+inf" || text == "Infinity") {
    return kInfinity;
  }
  if (text == "-inf" || text == "-Infinity") {
    return -kInfinity;
  }
  if (text == "nan" || text == "NaN") {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return std::nullopt;
}

std::string child_path(const std::string& parent, const std::string& key) {
  return parent.empty() ? key : parent + "." + key;
}

}  // namespace

/// Builds nodes from the two parsers' trees.
struct NodeBuilder {
  std::shared_ptr<const std::string> file;

  [[nodiscard]] Node make(Node::Kind kind, std::string path, int line) const {
    Node node;
    node.kind_ = kind;
    node.path_ = std::move(path);
    node.line_ = line;
    node.file_ = file;
    return node;
  }

  [[nodiscard]] Node from_toml(const toml::node& source, const std::string& path) const {
    const int line = static_cast<int>(source.source().begin.line);
    if (const auto* table = source.as_table()) {
      Node node = make(Node::Kind::kTable, path, line);
      for (const auto& [key, value] : *table) {
        const std::string name(key.str());
        node.members_.emplace_back(name, from_toml(value, child_path(path, name)));
      }
      return node;
    }
    if (const auto* array = source.as_array()) {
      Node node = make(Node::Kind::kArray, path, line);
      for (const auto& item : *array) {
        node.items_.push_back(from_toml(item, path + "[" + std::to_string(node.items_.size()) + "]"));
      }
      return node;
    }
    if (const auto* integer = source.as_integer()) {
      Node node = make(Node::Kind::kNumber, path, line);
      node.is_integer_ = true;
      node.integer_ = integer->get();
      node.number_ = static_cast<double>(node.integer_);
      return node;
    }
    if (const auto* number = source.as_floating_point()) {
      Node node = make(Node::Kind::kNumber, path, line);
      node.number_ = number->get();
      return node;
    }
    if (const auto* boolean = source.as_boolean()) {
      Node node = make(Node::Kind::kBoolean, path, line);
      node.boolean_ = boolean->get();
      return node;
    }
    if (const auto* text = source.as_string()) {
      Node node = make(Node::Kind::kText, path, line);
      node.text_ = text->get();
      return node;
    }
    make(Node::Kind::kNull, path, line).fail("a date or time", "a number, text, array or table");
  }

  [[nodiscard]] Node from_json(const nlohmann::ordered_json& source, const std::string& path) const {
    if (source.is_object()) {
      Node node = make(Node::Kind::kTable, path, 0);
      for (const auto& [key, value] : source.items()) {
        node.members_.emplace_back(key, from_json(value, child_path(path, key)));
      }
      return node;
    }
    if (source.is_array()) {
      Node node = make(Node::Kind::kArray, path, 0);
      node.items_.reserve(source.size());
      for (const auto& item : source) {
        node.items_.push_back(from_json(item, path + "[" + std::to_string(node.items_.size()) + "]"));
      }
      return node;
    }
    if (source.is_number()) {
      Node node = make(Node::Kind::kNumber, path, 0);
      node.number_ = source.get<double>();
      if (source.is_number_integer()) {
        node.is_integer_ = true;
        node.integer_ = source.get<std::int64_t>();
      }
      return node;
    }
    if (source.is_boolean()) {
      Node node = make(Node::Kind::kBoolean, path, 0);
      node.boolean_ = source.get<bool>();
      return node;
    }
    if (source.is_string()) {
      Node node = make(Node::Kind::kText, path, 0);
      node.text_ = source.get<std::string>();
      return node;
    }
    return make(Node::Kind::kNull, path, 0);
  }
};

std::string Node::where() const {
  std::string text = file_ ? *file_ : std::string();
  if (line_ > 0) {
    text += ":" + std::to_string(line_);
  }
  if (!path_.empty()) {
    text += (text.empty() ? "" : ": ") + path_;
  }
  return text;
}

void Node::fail(const std::string& found, const std::string& expected) const {
  throw Error({where(), found, expected});
}

std::string Node::describe() const {
  switch (kind_) {
    case Kind::kBoolean:
      return boolean_ ? "true" : "false";
    case Kind::kNumber: {
      if (is_integer_) {
        return std::to_string(integer_);
      }
      nlohmann::json number = number_;
      return std::isfinite(number_) ? number.dump()
                                    : (std::isnan(number_) ? "nan"
                                       : number_ > 0       ? "inf"
                                                           : "-inf");
    }
    case Kind::kText:
      return "\"" + text_ + "\"";
    case Kind::kArray:
      return "an array of " + std::to_string(items_.size());
    default:
      return std::string(kind_name(kind_));
  }
}

void Node::require_kind(Kind kind, std::string_view expected) const {
  read_ = true;
  if (kind_ != kind) {
    fail(describe(), std::string(expected));
  }
}

const Node* Node::find(std::string_view key) const {
  require_kind(Kind::kTable, "a table");
  for (const auto& [name, value] : members_) {
    if (name == key) {
      value.read_ = true;
      return &value;
    }
  }
  return nullptr;
}

bool Node::has(std::string_view key) const { return find(key) != nullptr; }

const Node& Node::at(std::string_view key) const {
  const Node* node = find(key);
  if (node == nullptr) {
    throw Error({where(), "no key '" + std::string(key) + "'", "it to be given"});
  }
  return *node;
}

const std::vector<Node>& Node::items() const {
  require_kind(Kind::kArray, "an array");
  for (const Node& item : items_) {
    item.read_ = true;
  }
  return items_;
}

const std::vector<std::pair<std::string, Node>>& Node::members() const {
  require_kind(Kind::kTable, "a table");
  return members_;
}

double Node::number_or_infinity() const {
  read_ = true;
  double value = number_;
  if (kind_ == Kind::kText && special_number(text_)) {
    value = *special_number(text_);
  } else if (kind_ != Kind::kNumber) {
    fail(describe(), "a number");
  }
  if (std::isnan(value)) {
    fail("nan", "a number");
  }
  return value;
}

double Node::number() const {
  const double value = number_or_infinity();
  if (!std::isfinite(value)) {
    fail(describe(), "a finite number");
  }
  return value;
}

std::int64_t Node::integer() const {
  require_kind(Kind::kNumber, "a whole number");
  constexpr double kExact = 9007199254740992.0;  // 2^53: beyond it a double is not one whole number
  if (!is_integer_ && (std::abs(number_) > kExact || std::floor(number_) != number_)) {
    fail(describe(), "a whole number");
  }
  return is_integer_ ? integer_ : static_cast<std::int64_t>(number_);
}

bool Node::boolean() const {
  require_kind(Kind::kBoolean, "true or false");
  return boolean_;
}

const std::string& Node::text() const {
  require_kind(Kind::kText, "text");
  return text_;
}

std::string Node::choice(std::initializer_list<std::string_view> names) const {
  std::string expected = "one of";
  for (const std::string_view name : names) {
    expected += " \"" + std::string(name) + "\"";
  }
  if (kind_ == Kind::kText) {
    for (const std::string_view name : names) {
      if (text_ == name) {
        read_ = true;
        return text_;
      }
    }
  }
  fail(describe(), expected);
}

std::vector<double> Node::numbers() const {
  std::vector<double> values;
  for (const Node& item : items()) {
    values.push_back(item.number());
  }
  return values;
}

Eigen::VectorXd Node::vector(Eigen::Index size) const {
  const std::string expected = "an array of " + std::to_string(size) + " numbers";
  require_kind(Kind::kArray, expected);
  if (static_cast<Eigen::Index>(items_.size()) != size) {
    fail(describe(), expected);
  }
  Eigen::VectorXd values(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    values[i] = items_[static_cast<std::size_t>(i)].number();
  }
  return values;
}

Eigen::MatrixXd Node::matrix() const {
  const std::vector<Node>& rows = items();
  if (rows.empty()) {
    return {};
  }
  const std::size_t columns = rows.front().items().size();
  Eigen::MatrixXd values(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    values.row(static_cast<Eigen::Index>(i)) = rows[i].vector(static_cast<Eigen::Index>(columns)).transpose();
  }
  return values;
}

std::vector<double> Node::range_or_numbers() const {
  if (kind_ != Kind::kTable) {
    return numbers();
  }
  const double start = at("start").number();
  const double stop = at("stop").number();
  const double step = at("step").number();
  if (!(step > 0.0)) {
    at("step").fail(at("step").describe(), "a positive step");
  }
  if (stop < start) {
    at("stop").fail(at("stop").describe(), "stop at or after start = " + at("start").describe());
  }
  constexpr double kSlack = 1e-9;      // of a step: 0.1 * 3 is a little more than 0.3
  constexpr double kMostValues = 2e7;  // more is a mistyped step, not a plan
  const double count = std::floor((stop - start) / step + kSlack);
  if (!(count < kMostValues)) {
    fail("more than 20 million values", "a larger step");
  }
  std::vector<double> values;
  for (double i = 0.0; i <= count; i += 1.0) {
    values.push_back(std::min(start + i * step, stop));
  }
  return values;
}

const Node* Node::first_unread() const {
  if (!read_) {
    return this;
  }
  for (const Node& item : items_) {
    if (item.kind_ == Kind::kTable || item.kind_ == Kind::kArray) {
      if (const Node* unread = item.first_unread()) {
        return unread;
      }
    }
  }
  for (const auto& [name, value] : members_) {
    if (const Node* unread = value.first_unread()) {
      return unread;
    }
  }
  return nullptr;
}

Document Document::load(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  const std::string ending = file.extension().string();
  Document document;
  if (ending == ".toml") {
    document = parse_toml(text, file.string());
  } else if (ending == ".json") {
    document = parse_json(text, file.string());
  } else {
    throw Error({file.string(), "ending '" + ending + "'", "a file ending in .toml or .json"});
  }
  document.folder_ = file.parent_path();
  return document;
}

Document Document::parse_toml(std::string_view text, const std::string& name) {
  try {
    const toml::table table = toml::parse(text, name);
    Document document;
    document.root_ = NodeBuilder{std::make_shared<const std::string>(name)}.from_toml(table, "");
    document.root_.line_ = 0;
    document.root_.read_ = true;
    return document;
  } catch (const toml::parse_error& error) {
    throw Error({name + ":" + std::to_string(error.source().begin.line), std::string(error.description()),
                 "a TOML document"});
  }
}

Document Document::parse_json(std::string_view text, const std::string& name) {
  try {
    const auto tree = nlohmann::ordered_json::parse(quote_bare_words(text));
    if (!tree.is_object()) {
      throw Error({name, std::string(tree.type_name()), "a JSON object"});
    }
    Document document;
    document.root_ = NodeBuilder{std::make_shared<const std::string>(name)}.from_json(tree, "");
    document.root_.read_ = true;
    return document;
  } catch (const nlohmann::json::exception& error) {
    throw Error({name, error.what(), "a JSON document"});
  }
}

std::filesystem::path Document::resolve(const std::string& named) const {
  const std::filesystem::path path(named);
  return path.is_absolute() ? path : folder_ / path;
}

void Document::reject_unknown() const {
  if (const Node* unread = root_.first_unread()) {
    throw Error({unread->where(), "an unknown key", "only keys of the documented format"});
  }
}

}  // namespace trammel::io
