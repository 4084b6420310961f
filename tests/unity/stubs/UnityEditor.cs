// Stub of the parts of UnityEditor that the package uses: drawing of fields, selection, prefabs, scenes and builds. The
// asset database is in UnityAssets.cs.
using System;
using System.Collections.Generic;
using System.Linq;
using UnityEngine;
using Object = UnityEngine.Object;

namespace UnityEditor
{
    public sealed class MenuItem : Attribute
    {
        public MenuItem(string itemName) { }
        public MenuItem(string itemName, bool isValidateFunction) { }
        public MenuItem(string itemName, bool isValidateFunction, int priority) { }
    }

    public sealed class CustomPropertyDrawer : Attribute
    {
        public CustomPropertyDrawer(Type type) { }
    }

    public abstract class PropertyDrawer
    {
        public virtual void OnGUI(Rect position, SerializedProperty property, GUIContent label) { }
    }

    /// <summary>A field of an object, found by its name. It offers a FieldInfo under Unity's names.</summary>
    public class SerializedProperty
    {
        readonly object owner;
        readonly System.Reflection.FieldInfo field;
        readonly object element;
        public SerializedProperty(object element) { this.element = element; }
        SerializedProperty(object owner, System.Reflection.FieldInfo field) { this.owner = owner; this.field = field; }
        object Value { get { return field == null ? element : field.GetValue(owner); } }
        public SerializedProperty FindPropertyRelative(string relativePropertyPath)
        {
            var found = Value.GetType().GetField(relativePropertyPath);
            return found == null ? null : new SerializedProperty(Value, found);
        }
        public int arraySize { get { return ((Array)Value).Length; } set { throw new NotSupportedException(); } }
        public SerializedProperty GetArrayElementAtIndex(int index) { return new SerializedProperty(((Array)Value).GetValue(index)); }
        public string stringValue { get { return (string)Value; } set { field.SetValue(owner, value); } }
        public bool boolValue { get { return (bool)Value; } set { field.SetValue(owner, value); } }
        public int intValue { get { return (int)Value; } set { field.SetValue(owner, value); } }
    }

    public sealed class EditorGUI
    {
        public static readonly List<string> Drawn = new List<string>();  // only in the stub
        public static GUIContent BeginProperty(Rect totalPosition, GUIContent label, SerializedProperty property) { return label; }
        public static void EndProperty() { }
        static readonly Stack<bool> changes = new Stack<bool>();
        internal static void Change() { changes.Pop(); changes.Push(true); }
        public static void BeginChangeCheck() { changes.Push(false); }
        public static bool EndChangeCheck()
        {
            var changed = changes.Pop();
            if (changed && changes.Count > 0) Change();
            return changed;
        }
        public static bool ToggleLeft(Rect position, string label, bool value) { Drawn.Add(position.x + "+" + position.width + " " + label); return !value; }
        public static bool PropertyField(Rect position, SerializedProperty property, GUIContent label) { Drawn.Add(position.x + "+" + position.width); return property == null; }
        public static int Popup(Rect position, int selectedIndex, string[] displayedOptions)
        {
            Drawn.Add(position.x + "+" + position.width + " " + string.Join(", ", displayedOptions) + " " + selectedIndex);
            return displayedOptions.Length - 1;
        }
    }

    /// <summary>Draws fields of a window. A test sets the new values of fields by their labels, as if a user changed
    /// them.</summary>
    public sealed class EditorGUILayout
    {
        public static readonly List<string> Drawn = new List<string>();  // only in the stub
        public static readonly Dictionary<string, object> Changes = new Dictionary<string, object>();  // only in the stub

        static T Field<T>(string label, T value)
        {
            Drawn.Add(label);
            object change;
            if (!Changes.TryGetValue(label, out change)) return value;
            Changes.Remove(label);
            EditorGUI.Change();
            var edit = change as Func<T, T>;
            return edit != null ? edit(value) : (T)change;
        }
        public static Object ObjectField(string label, Object obj, Type objType, bool allowSceneObjects, params GUILayoutOption[] options) { return Field(label, obj); }
        public static bool ToggleLeft(string label, bool value, params GUILayoutOption[] options) { return Field(label, value); }
        public static int Popup(string label, int selectedIndex, string[] displayedOptions, params GUILayoutOption[] options) { return Field(label, selectedIndex); }
        public static AnimationCurve CurveField(string label, AnimationCurve value, Color color, Rect ranges, params GUILayoutOption[] options) { return Field(label, value); }
        public static Gradient GradientField(string label, Gradient value, params GUILayoutOption[] options) { return Field(label, value); }
        public static bool PropertyField(SerializedProperty property, GUIContent label, bool includeChildren, params GUILayoutOption[] options) { return false; }
        public static void LabelField(string label, params GUILayoutOption[] options) { Drawn.Add(label); }
        public static void HelpBox(string message, MessageType type) { Drawn.Add(message); }
        public static Vector2 BeginScrollView(Vector2 scrollPosition, params GUILayoutOption[] options) { return scrollPosition; }
        public static void EndScrollView() { }
    }

    public enum MessageType { None, Info, Warning, Error }

    public class EditorWindow : ScriptableObject
    {
        public static T GetWindow<T>(string title) where T : EditorWindow { return (T)Activator.CreateInstance(typeof(T)); }
    }

    public sealed class Undo
    {
        public static void RecordObject(Object objectToUndo, string name) { }
    }

    public sealed class Selection
    {
        public static Object activeObject { get; set; }
        public static GameObject activeGameObject { get { return activeObject as GameObject; } }
        public static Object[] objects { get { return activeObject == null ? new Object[0] : new[] { activeObject }; } }
    }

    public sealed class ShaderUtil
    {
        public static bool ShaderHasError(Shader s) { return false; }
    }

    public sealed class PrefabUtility
    {
        public static Object InstantiatePrefab(Object assetComponentOrGameObject) { return assetComponentOrGameObject; }
    }

    public class EditorUtility
    {
        public static string OpenFolderPanel(string title, string folder, string defaultName) { return ""; }
        public static string OpenFilePanel(string title, string directory, string extension) { return ""; }
        public static string SaveFilePanel(string title, string directory, string defaultName, string extension) { return ""; }
        public static bool DisplayDialog(string title, string message, string ok) { return true; }
        public static void SetDirty(Object target) { }
    }

    public sealed class InitializeOnLoad : Attribute { }

    public sealed class EditorApplication
    {
        public delegate void CallbackFunction();
        public static CallbackFunction delayCall;
        public static event Action<bool> focusChanged;
        public static void Focus() { if (focusChanged != null) focusChanged(true); }  // only in the stub: the user comes back to the editor
    }

    public sealed class CustomEditor : Attribute { public CustomEditor(Type inspectedType) { } }

    public class Editor : ScriptableObject
    {
        public Object target { get; set; }
        public SerializedObject serializedObject { get { return new SerializedObject(); } }
        public virtual void OnInspectorGUI() { }
    }

    public class SerializedObject
    {
        public void Update() { }
        public bool ApplyModifiedProperties() { return false; }
        public SerializedProperty FindProperty(string propertyPath) { return null; }
    }

    public struct BuildPlayerOptions
    {
        public string[] scenes { get; set; }
    }
}

namespace UnityEditor.Build
{
    public class BuildFailedException : Exception { public BuildFailedException(string message) : base(message) { } }

    public sealed class BuildPlayerContext
    {
        public readonly List<string> Added = new List<string>();  // only in the stub
        public BuildPlayerOptions BuildPlayerOptions { get; set; }
        public void AddAdditionalPathToStreamingAssets(string directoryOrFile, string pathInStreamingAssets = null) { Added.Add(pathInStreamingAssets); }
    }

    public abstract class BuildPlayerProcessor
    {
        public virtual int callbackOrder { get { return 0; } }
        public abstract void PrepareForBuild(BuildPlayerContext buildPlayerContext);
    }
}

namespace UnityEditor.SceneManagement
{
    public enum NewSceneSetup { EmptyScene, DefaultGameObjects }
    public enum NewSceneMode { Single, Additive }
    public struct Scene { }  // in UnityEngine.SceneManagement in Unity
    public sealed class EditorSceneManager
    {
        public static bool SaveCurrentModifiedScenesIfUserWantsTo() { return true; }
        public static Scene NewScene(NewSceneSetup setup, NewSceneMode mode) { return new Scene(); }
        public static bool SaveScene(Scene scene, string dstScenePath) { return true; }
    }
}
