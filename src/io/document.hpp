// SPDX-License-Identifier: Apache-2.0
/// @file
/// Input trees from TOML or JSON files with errors that name file, line and key.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace trammel::io {

/// A value of an input tree. A reader asks for what it expects; what it did not ask for is an error at the
/// end (Document::reject_unknown), so a misspelt key never passes in silence.
class Node {
 public:
  enum class Kind { kNull, kBoolean, kNumber, kText, kArray, kTable };

  [[nodiscard]] Kind kind() const { return kind_; }
  /// "file.toml:12: bounds.position_m" (no line for JSON).
  [[nodiscard]] std::string where() const;
  /// Dotted key path from the root, "station[0].covariance".
  [[nodiscard]] const std::string& path() const { return path_; }

  [[nodiscard]] bool has(std::string_view key) const;
  /// Member of a table; an Error if it is absent or this is not a table.
  [[nodiscard]] const Node& at(std::string_view key) const;
  /// Member of a table, or null.
  [[nodiscard]] const Node* find(std::string_view key) const;
  /// Elements of an array; an Error if this is not one.
  [[nodiscard]] const std::vector<Node>& items() const;
  /// Members of a table in file order; marks this table itself as read, not its members.
  [[nodiscard]] const std::vector<std::pair<std::string, Node>>& members() const;

  /// A finite number.
  [[nodiscard]] double number() const;
  /// A number; infinities allowed (TOML inf, JSON "inf" or Infinity), NaN is an Error.
  [[nodiscard]] double number_or_infinity() const;
  [[nodiscard]] std::int64_t integer() const;
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] const std::string& text() const;
  /// One of the names given; an Error listing them otherwise.
  [[nodiscard]] std::string choice(std::initializer_list<std::string_view> names) const;

  /// Finite numbers of an array.
  [[nodiscard]] std::vector<double> numbers() const;
  /// Exactly `size` finite numbers.
  [[nodiscard]] Eigen::VectorXd vector(Eigen::Index size) const;
  /// An array of rows of finite numbers, all rows of equal length. Empty array: 0 x 0.
  [[nodiscard]] Eigen::MatrixXd matrix() const;
  /// Numbers of an array, or of {start, stop, step}: start, start + step, ... up to stop (inclusive within
  /// 1e-9 step).
  [[nodiscard]] std::vector<double> range_or_numbers() const;

  /// Throws an Error at this node.
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const;
  /// What stands here, in a few words, for error messages.
  [[nodiscard]] std::string describe() const;

 private:
  friend class Document;
  friend struct NodeBuilder;

  void require_kind(Kind kind, std::string_view expected) const;
  [[nodiscard]] const Node* first_unread() const;

  Kind kind_ = Kind::kNull;
  bool boolean_ = false;
  bool is_integer_ = false;
  double number_ = 0.0;
  std::int64_t integer_ = 0;
  std::string text_;
  std::vector<Node> items_;
  std::vector<std::pair<std::string, Node>> members_;
  std::string path_;
  int line_ = 0;
  std::shared_ptr<const std::string> file_;
  mutable bool read_ = false;
};

/// A whole input file.
class Document {
 public:
  /// Reads a file, TOML or JSON by its ending (.toml, .json). Throws Error on anything unreadable.
  static Document load(const std::filesystem::path& file);
  /// Parses text; `name` is used in messages.
  static Document parse_toml(std::string_view text, const std::string& name);
  static Document parse_json(std::string_view text, const std::string& name);

  [[nodiscard]] const Node& root() const { return root_; }
  /// Path of a file named in this document: relative ones are relative to the document's folder.
  [[nodiscard]] std::filesystem::path resolve(const std::string& named) const;
  /// Throws Error at the first key that nobody asked for.
  void reject_unknown() const;

 private:
  Node root_;
  std::filesystem::path folder_;
};

}  // namespace trammel::io
