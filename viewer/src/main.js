// What the page can do beyond being read: tables that sort, plots, rows that open their cell, and views to fly through.

import {openCellsByRow} from "./cells.js";
import {drawPlots} from "./plots.js";
import styles from "./viewer.css";
import {makeSortable} from "./tables.js";
import {prepareViews} from "./view/prepare.js";

const style = document.createElement("style");
style.textContent = styles;
document.head.append(style);

document.querySelectorAll("table.sortable").forEach(makeSortable);
openCellsByRow(document);
drawPlots(document);
prepareViews(document);
